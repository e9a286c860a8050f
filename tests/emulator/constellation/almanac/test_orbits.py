"""Orbits from almanacs, against a published example, RTKLIB, integration, and numerical differentiation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.constellation.almanac import glonass as almanac_glonass
from gnss_hil.emulator.constellation.almanac import orbits
from gnss_hil.emulator.constellation.broadcast.glonass import ROTATION_PZ90_RPS, derivative
from gnss_hil.emulator.files.almanacs import Almanac
from tests.support.outside import peer

# GLONASS ICD 5.1, A.3.2.3: almanac of day 615, wanted 33 300 s into that day (Moscow).
EXAMPLE = {
    "longitude": -0.189986229 * np.pi, "delta_i": 0.011929512 * np.pi, "omega": 0.440277100 * np.pi,
    "e": 0.001482010, "delta_t": -2655.76171875, "delta_t_dot": 0.000549316,
}  # fmt: skip
NODE_S, WANTED_S, SIDEREAL_RAD = 27_122.09375, 33_300.0, 6.02401539573
INERTIAL_KM = np.array((10_947.021572, 13_078.978287, 18_922.063362))
INERTIAL_KMPS = np.array((-3.375497, -0.161453, 2.060844))

GPS = {
    "e": [5.221366882e-3, 0.01561927795, 2.446174622e-4],
    "i0": [0.963785748, 0.9425197409, 0.9596931352],
    "omega_dot": [-7.897471819e-9, -8.091765626e-9, -7.817468486e-9],
    "sqrt_a": [5153.602051, 5153.698242, 5153.68457],
    "omega0": [-1.159458779, -1.203799662, 2.1],
    "omega": [0.451712027, -2.138141893, -3.0],
    "m0": [-2.105941778, -1.698904695, 0.4],
}
TOA_NS = gpstime.from_week(1890, 589_824)


def glonass(seconds, elements=EXAMPLE):
    seconds = np.asarray(seconds, float)
    return almanac_glonass.orbit({k: np.full(seconds.shape, v) for k, v in elements.items()}, seconds)


def gps_almanac(numbers=(1, 2, 3), toa_ns=TOA_NS, healthy=True):
    n = len(numbers)
    return Almanac(
        satellites.GPS, np.array(numbers), np.full(n, healthy), np.full(n, toa_ns),
        {name: np.array(values[:n]) for name, values in GPS.items()},
    )  # fmt: skip


@pytest.mark.verifies(
    "emulator/constellation/almanac/glonass.py",
    what="Orbits from GLONASS almanacs",
    by=(
        "worked example of ICD 5.1, A.3.2.3 (at second hand): 0.2 m, 1 mm/s; DOP853 under J2: nodes within "
        "30 m, 20 m across the track, but up to 4.8 km ahead along it before a node, as the document has it"
    ),
    status="validated",
)
def test_glonass_example_of_the_interface_document():
    """As printed, in inertial axes; the document stops its axis when it moves less than 1 cm."""
    (pos,), (vel,) = glonass([WANTED_S - NODE_S])
    angle = SIDEREAL_RAD + ROTATION_PZ90_RPS * (WANTED_S - 10_800)
    turn = np.array(((np.cos(angle), -np.sin(angle), 0), (np.sin(angle), np.cos(angle), 0), (0, 0, 1)))
    inertial = turn @ (vel + np.cross((0, 0, ROTATION_PZ90_RPS), pos))
    assert np.abs(turn @ pos - 1e3 * INERTIAL_KM).max() < 0.2
    assert np.abs(inertial - 1e3 * INERTIAL_KMPS).max() < 1e-3


def integrated(seconds):
    """(s, 3) motion under the central force and J2 from the example's node on."""
    (pos,), (vel,) = glonass([1e-6])
    found = solve_ivp(
        lambda t, y: derivative(y, np.zeros(3)), (0, max(seconds)), np.concatenate((pos, vel)),
        method="DOP853", rtol=1e-12, atol=1e-6, t_eval=seconds,
    )  # fmt: skip
    return found.y[:3].T, found.y[3:].T


def test_glonass_nodes_follow_the_motion_under_j2():
    period_s = almanac_glonass.MEAN_PERIOD_S + EXAMPLE["delta_t"]
    seconds = np.array([1, 2]) * period_s + np.array([1, 2]) ** 2 * EXAMPLE["delta_t_dot"] + 1
    assert np.linalg.norm(glonass(seconds)[0] - integrated(seconds)[0], axis=1).max() < 30


def test_glonass_runs_ahead_along_its_track_within_a_revolution():
    """The document's drift of the argument of latitude, up to 4.8 km; across the track it is right."""
    seconds = np.linspace(500, 40_000, 30)
    motion, speed = integrated(seconds)
    inertial = speed + np.cross((0, 0, ROTATION_PZ90_RPS), motion)
    along = inertial / np.linalg.norm(inertial, axis=1, keepdims=True)
    off = glonass(seconds)[0] - motion
    ahead = np.einsum("ij,ij->i", off, along)
    assert np.linalg.norm(off - ahead[:, None] * along, axis=1).max() < 20
    assert 4000 < np.abs(ahead).max() < 5000


def test_glonass_crosses_the_equator_northwards_where_and_when_it_says():
    (pos,), (vel,) = glonass([0.0])
    assert abs(pos[2]) < 1e-3
    assert vel[2] > 3000
    assert np.arctan2(pos[1], pos[0]) == pytest.approx(EXAMPLE["longitude"], abs=1e-9)


@pytest.mark.verifies(
    "emulator/constellation/almanac/orbits.py",
    what="Orbits from GPS almanacs, what is held of a sky",
    by="RTKLIB's alm2pos within 5 cm, from three days before to a month after; vis-viva and area law",
    status="validated",
)
def test_gps_against_rtklib():
    rtk = peer("pyrtklib")
    held = orbits.hold(satellites.index(satellites.GPS, np.array([1, 2, 3])), [gps_almanac()], TOA_NS)
    for age_s in (-3e5, 0, 1800, 4e4, 2.6e6):
        predicted = held.at(np.arange(3), TOA_NS + round(age_s * 1e9))
        for k in range(3):
            alm, pos, clock = rtk.alm_t(), rtk.Arr1Ddouble(3), rtk.Arr1Ddouble(1)
            alm.toa, alm.toas = rtk.gpst2time(1890, 589_824), 589_824
            alm.A, alm.e, alm.i0, alm.OMG0 = (
                GPS["sqrt_a"][k] ** 2, GPS["e"][k], GPS["i0"][k], GPS["omega0"][k],
            )  # fmt: skip
            alm.OMGd, alm.omg, alm.M0 = GPS["omega_dot"][k], GPS["omega"][k], GPS["m0"][k]
            rtk.alm2pos(rtk.timeadd(rtk.gpst2time(1890, 589_824), age_s), alm, pos, clock)
            theirs = np.array([pos[axis] for axis in range(3)])
            assert np.linalg.norm(predicted.pos_ecef_m[k] - theirs) < 0.05


def test_gps_velocities_are_those_of_an_ellipse():
    """Vis-viva and the area law in inertial axes; the node's precession, 0.2 m/s at most, is not in them."""
    held = orbits.hold(satellites.index(satellites.GPS, np.array([1, 2, 3])), [gps_almanac()], TOA_NS)
    mu, e, axis = 3.986005e14, np.array(GPS["e"]), np.array(GPS["sqrt_a"]) ** 2
    for age_s in (0, 12_345, 2e6):
        predicted = held.at(np.arange(3), TOA_NS + round(age_s * 1e9))
        turning = np.zeros((3, 3))
        turning[:, 2] = 7.2921151467e-5 - np.array(GPS["omega_dot"])
        inertial = predicted.vel_ecef_mps + np.cross(turning, predicted.pos_ecef_m)
        radius = np.linalg.norm(predicted.pos_ecef_m, axis=1)
        assert np.linalg.norm(inertial, axis=1) == pytest.approx(np.sqrt(mu * (2 / radius - 1 / axis)), 1e-7)
        area = np.linalg.norm(np.cross(predicted.pos_ecef_m, inertial), axis=1)
        assert area == pytest.approx(np.sqrt(mu * axis * (1 - e**2)), rel=1e-7)


@pytest.mark.parametrize("age_s", [500.0, 6000.0, 39_000.0, 1e6, -1e5])
def test_glonass_velocities_are_rates_of_its_places(age_s):
    """But for the drift of the argument of latitude, 0.12 m/s, that only the places have."""
    (before, after), _ = glonass([age_s - 1, age_s + 1])
    assert np.abs(glonass([age_s])[1][0] - (after - before) / 2).max() < 0.15


def test_what_is_held_of_a_sky():
    """Satellites of the sky alone; of two almanacs the nearer one; age on either side of the reference."""
    index = satellites.index(satellites.GPS, np.array([9, 3, 1]))
    old, new = gps_almanac((1, 2, 3), TOA_NS - 10**16), gps_almanac((1,), healthy=False)
    held = orbits.hold(index, [old, new], TOA_NS)
    assert held.known.tolist() == [False, True, True]
    predicted = held.at(np.array([1, 2]), TOA_NS - 2 * 3600 * 10**9)
    assert predicted.healthy.tolist() == [True, False]
    assert predicted.age_h == pytest.approx([1e7 / 3600 - 2, 2])
    alone = orbits.hold(index[2:], [new], TOA_NS).at(np.array([0]), TOA_NS - 2 * 3600 * 10**9)
    assert predicted.pos_ecef_m[1].tolist() == alone.pos_ecef_m[0].tolist()
    back = orbits.hold(index, [new, old], TOA_NS)
    assert back.at(np.array([2]), TOA_NS).healthy.tolist() == [False]
    then = orbits.hold(index, [old, new], TOA_NS - 10**16)
    assert then.at(np.array([2]), TOA_NS - 10**16).healthy.tolist() == [True]


def test_an_old_almanac_and_one_that_lacks_satellites_are_told():
    index = satellites.index(satellites.GPS, np.array([9, 3, 1]))
    held = orbits.hold(index, [gps_almanac((1, 3, 9))], TOA_NS)
    week_ns = 7 * 86400 * 10**9
    assert not list(orbits.remarks(held, index, TOA_NS - week_ns))
    assert list(orbits.remarks(held, index, TOA_NS + 10 * week_ns)) == [
        "the almanac is up to 70 days from the run (3 of 3 satellites more than 7)"
    ]
    lacking = orbits.hold(index, [gps_almanac((3,))], TOA_NS)
    assert list(orbits.remarks(lacking, index, TOA_NS)) == [
        "no entry of G01 and G09: receivers do not know of them"
    ]
