"""What the structure does to channels: rates against differences, Soyuz and ISS as they ship."""

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.emulator.assemble.emulated import FASTEST_TURN_RPS
from gnss_hil.emulator.error_models.multipath import Multipath
from gnss_hil.emulator.numerics.rotations import dcm_321
from gnss_hil.emulator.signal.correlation import triangle
from gnss_hil.emulator.signal.multipath import reception
from gnss_hil.emulator.signal.multipath.reception import Signals
from gnss_hil.emulator.signal.structure import file, poses
from gnss_hil.emulator.signal.structure.bodies import bodies_at, structure
from gnss_hil.emulator.signal.structure.poses import SightLines
from gnss_hil.emulator.signal.structure.reflections import Pairs
from gnss_hil.emulator.signal.structure.shadowing import blocked

RNG = np.random.default_rng(21)
RATE = np.array((0.0, -1.13e-3, 0.0))
"""Body rate of a craft that keeps its orbital attitude at 400 km [rad/s]."""

SUN = np.array((0.3, 0.5, -0.8)) / np.sqrt(0.98)
TARGETS_M = 2.2e7 * RNG.normal(size=(40, 3))
TARGETS_MPS = 4e3 * RNG.normal(size=(40, 3))


def flat_gain(antenna, direction):
    return np.zeros(len(antenna))


def attitude(t_s, rate=RATE):
    return dcm_321(0.0, rate[1] * t_s, 0.0)


def sky(t_s, rate=RATE):
    """Unit vectors and distances in body axes at t_s, for a craft that turns at a rate."""
    towards = (TARGETS_M + TARGETS_MPS * t_s) @ attitude(t_s, rate).T
    distance = np.linalg.norm(towards, axis=1)
    return towards / distance[:, None], distance


def craft(name, antennas):
    return structure(file.load(file.find(name))), vehicle.load(vehicle.find(antennas)).lever_arm_body_m


def at(ship, t_s, rate=RATE):
    los, distance = sky(t_s, rate)
    turn = poses.los_rate_body(los, TARGETS_MPS @ attitude(t_s, rate).T, distance, rate)
    return poses.pose(ship, SightLines(los, turn), attitude(t_s, rate) @ SUN, rate, t_s)


def received(ship, antennas_m, t_s, chip_m=293.05, rate=RATE, **settings):
    pose = at(ship, t_s, rate)
    antenna, satellite = np.repeat(np.arange(len(antennas_m)), 40), np.tile(np.arange(40), len(antennas_m))
    direct = (~blocked(pose.bodies, antennas_m, pose.los_body)).astype(float).ravel()
    count = len(antenna)
    pairs, chips_m = Pairs(antenna, satellite), np.zeros(count) + chip_m
    signals = Signals(pairs, direct, np.full(count, 0.1903), chips_m)
    return direct, reception.receive(ship, pose, antennas_m, flat_gain, signals, Multipath(**settings), 0.5)


@pytest.mark.verifies(
    "emulator/signal/multipath/reception.py",
    what="Range rates of multipath",
    by=(
        "consistent with the engine's own phases at other epochs while the arrays turn, 0.01 mm/s: not "
        "judged from outside (phases are, by correlators)"
    ),
    status="modelled",
)
@pytest.mark.parametrize("times", [1, 15, 106])
def test_range_rates_are_the_phases_derivatives(times):
    """A quarter of a second to either side in the orbital attitude, less in slews, the last one as fast as
    may be: the rate in the middle is the difference of phases, if no ray came or went between."""
    shape, antennas_m = craft("iss", "iss-asn-m")
    rate, step = times * RATE, 0.25 / times
    assert step > poses.LATER_S and abs(rate[1]) <= FASTEST_TURN_RPS
    _, before = received(shape, antennas_m, -step, rate=rate)
    hidden, now = received(shape, antennas_m, -poses.LATER_S / 2, rate=rate)
    _, after = received(shape, antennas_m, step, rate=rate)
    slope = (after.phase_m - before.phase_m) / (2 * step)
    with np.errstate(invalid="ignore"):  # hidden before and after
        steady = np.isfinite(now.level_db) & (np.abs(after.level_db - before.level_db) < 0.2)
    moving = (np.abs(now.rate_mps) > 1e-5) & steady
    assert moving.sum() > 10
    assert np.abs(now.rate_mps[moving & (hidden == 0)]).max() > 0.01 * times
    np.testing.assert_allclose(now.rate_mps[moving], slope[moving], atol=1e-5 * times, rtol=1e-3)


def test_who_has_no_reflection_has_no_error():
    shape, antennas_m = craft("soyuz-ms", "soyuz-ms")
    direct, found = received(shape, antennas_m, 0.0, least_amplitude=0.99)
    free = direct == 1
    assert not found.range_m[free].any()
    assert not found.rate_mps[free].any()
    assert (found.level_db[free] == 0).all()
    assert (found.level_db[~free] == -np.inf).all()


def test_hidden_satellites_are_heard_late():
    """A reflection alone: late by its whole path, and weaker."""
    shape, antennas_m = craft("iss", "iss-asn-m")
    direct, found = received(shape, antennas_m, 0.0)
    held = (direct == 0) & np.isfinite(found.level_db)
    assert held.sum() > 0
    assert (found.range_m[held] > 0).all()
    assert (found.level_db[held] < 0).all()


def test_a_lone_reflection_is_as_weak_as_the_antenna_is_deaf_to_it():
    """Metal makes a right-handed wave a left-handed one: what is received 6 dB worse comes 6 dB weaker."""
    shape, antennas_m = craft("iss", "iss-asn-m")
    alone = {"reflections": 1, "least_amplitude": 0.0}
    direct, found = received(shape, antennas_m, 0.0, cross_polar_db=4.0, **alone)
    _, deaf = received(shape, antennas_m, 0.0, cross_polar_db=10.0, **alone)
    held = (direct == 0) & np.isfinite(found.level_db)
    assert held.sum() > 0
    assert found.level_db[held] - deaf.level_db[held] == pytest.approx(np.full(held.sum(), 6.0), abs=0.01)
    assert (found.level_db[held] < -3.9).all()


def test_no_channel():
    shape, antennas_m = craft("iss", "iss-asn-m")
    none = np.zeros(0, np.int64)
    signals = Signals(Pairs(none, none), np.zeros(0), np.zeros(0), np.zeros(0))
    found = reception.receive(shape, at(shape, 0.0), antennas_m, flat_gain, signals, Multipath(), 0.5)
    assert len(found.range_m) == 0


def test_a_front_end_without_limit_has_the_triangle():
    assert reception.correlation_of(Multipath(), 293.05) is triangle
    narrow = reception.correlation_of(Multipath(bandwidth_mhz=2.046), 293.05)
    assert narrow(np.array(1.0)) > 0


def test_each_code_has_its_own_band():
    """GPS and GLONASS through one narrow front end: each as alone, and not alike."""
    shape, antennas_m = craft("iss", "iss-asn-m")
    chips = np.tile((293.05, 586.68), 80)
    found = [
        received(shape, antennas_m, 0.0, chip_m=chip_m, bandwidth_mhz=2.5)[1].range_m
        for chip_m in (chips, 293.05, 586.68)
    ]
    assert (found[0] == np.where(chips == 293.05, found[1], found[2])).all()
    assert np.abs(found[1] - found[2]).max() > 1e-3


def test_zvezda_hides_what_is_below_it():
    """Every antenna of the ISS stands on Zvezda: straight down nothing is seen; those on the open large
    diameter see straight up."""
    shape, antennas_m = craft("iss", "iss-asn-m")
    los = np.array([[0.0, 0, 1], [0, 0, -1]])
    hidden = blocked(bodies_at(shape, SUN, 0.0), antennas_m, los)
    assert hidden[:, 0].all()
    assert not hidden[2:, 1].any()
