"""What error models do to signals, judged by what physics asks of every signal, not by the models.

A signal's rate is that of its carrier. The ionosphere delays codes and advances carriers by the same length.
What is heard by reflection alone comes late. What a satellite reports of itself moves as it says.
"""

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites, vehicle
from gnss_hil.emulator import assemble
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.environment.signals import signals
from tests.support import emulated

pytestmark = pytest.mark.verifies(what="Error models in a run")

LIGHT = 299_792_458.0
STATION = {"vehicle": "iss-asn-m.toml", "structure": "iss"}


def craft(sky=None, interval_s=0.25, tables=None, **factors):
    """The only craft of a world in which these factors disturb, and no noise."""
    tables = {"clock": {"amplitude_ms": 0.0}, **(tables or {})}
    given = emulated.craft(receivers=emulated.QUICK, factors={**emulated.QUIET, **factors}) | tables
    document = emulated.document(given, interval_s=interval_s, sky={"factors": sky or {}})
    antennas = vehicle.load(vehicle.find(given["vehicle"].removesuffix(".toml")))
    return assemble.build_world(scenario.parse(document, "test"), [antennas], 7).craft[0]


def block_of(one, epoch=0):
    return one.prepared(epoch)[0].block


def over(one, pairs, epochs):
    """Signals of pairs (2, p) of antennas and satellites in epochs of the first block."""
    return [signals(one.environment, block_of(one), np.full(len(pairs[0]), k), *pairs) for k in epochs]


def added(epochs, sky=None, interval_s=0.25, tables=None, **factors):
    """What the factors add to range [m], carrier [m], rate [m/s]: (epochs, p) each; and signals with them."""
    plain = craft(interval_s=interval_s, tables=tables)
    pairs = block_of(plain).signal[list(epochs)].all(axis=0).nonzero()
    without = over(plain, pairs, epochs)
    with_them = over(craft(sky, interval_s, tables, **factors), pairs, epochs)
    both = list(zip(without, with_them, strict=True))
    return (
        np.array([b.pseudorange_m - a.pseudorange_m for a, b in both]),
        np.array([(b.cycles - a.cycles) * a.at.wave_m for a, b in both]),
        np.array([b.range_rate_mps - a.range_rate_mps for a, b in both]),
        with_them,
    )


def derivative(values, interval_s):
    """Of five epochs (5, p) in the middle one, to fourth order."""
    return (8 * (values[3] - values[1]) - (values[4] - values[0])) / (12 * interval_s)


def test_the_ionosphere_delays_codes_and_advances_carriers_by_as_much():
    """Kaplan & Hegarty, 3rd ed., 10.2.4: the rate is the carrier's."""
    code, carrier, rate, _ = added(range(5), sky={"ionosphere": {"activity": "high"}}, interval_s=1.0)
    assert (code > 0.1).all()
    assert carrier == pytest.approx(-code, abs=1e-5)  # of 1e7 cycles
    assert rate[2] == pytest.approx(derivative(carrier, 1.0), abs=3e-4)
    assert np.abs(rate[2]).max() > 5e-3


def test_p1_less_c1_is_what_a_code_comes_early_by():
    """P1 - C1 = 10 ns of all GPS satellites: 2.998 m off every C/A pseudorange, and of nothing else."""
    table = {f"G{number:02d}": 10.0 for number in range(1, 33)}
    code, carrier, rate, seen = added([0], sky={"code_bias": {"p1_c1_ns": table}})
    gps = seen[0].at.system == satellites.GPS
    assert code[0] == pytest.approx(np.where(gps, -2.99792458, 0.0), abs=1e-6)
    assert gps.any() and not gps.all()
    assert not carrier.any() and not rate.any()


def test_a_slope_by_frequency_is_proportional_to_the_frequency_number():
    slope = {"slope_m_per_channel": 1.0, "scatter_m": 0.0, "hardware_m": 0.0}
    code, carrier, _, seen = added([0], interchannel_bias=slope)
    at, block = seen[0].at, seen[0].at.epochs
    number = block.sky.broadcast.frequency[at.at, at.row]
    glonass = at.system == satellites.GLONASS
    for receiver in range(4):
        mine = at.receiver == receiver
        per_number = code[0][mine & glonass & (number != 0)] / number[mine & glonass & (number != 0)]
        assert len(per_number) > 2 and np.ptp(per_number) < 1e-6 and abs(per_number[0]) > 1e-3
        assert not code[0][mine & ~(glonass & (number != 0))].any()
    assert not carrier.any()


def test_a_receivers_delay_is_of_all_its_signals():
    delay = {"slope_m_per_channel": 0.0, "scatter_m": 0.0, "hardware_m": 3.0}
    code, _, _, seen = added([0], interchannel_bias=delay)
    of_receiver = [code[0][seen[0].at.receiver == receiver] for receiver in range(4)]
    assert max(np.ptp(off) for off in of_receiver) < 1e-6
    assert np.ptp([off[0] for off in of_receiver]) > 0.1


def test_beside_a_structure_the_rate_is_the_carriers():
    """Reflections fade as the rays turn about the structure."""
    code, carrier, rate, _ = added(range(5), tables=STATION, multipath=True)
    assert code.any() and np.abs(rate[2]).max() > 1e-4
    assert rate[2] == pytest.approx(derivative(carrier, 0.25), abs=5e-6)


def test_what_is_heard_by_reflection_alone_comes_late():
    """The way by the structure is longer than the straight one: code and carrier by as much."""
    one = craft(interval_s=10.0, tables=STATION, shadowing=True, multipath=True)
    straight = craft(interval_s=10.0, tables=STATION)
    late = 0
    for first in range(192, 600, 64):
        block = block_of(one, first)
        epoch, *pair = (block.hidden & block.signal).nonzero()
        heard = signals(one.environment, block, epoch, *pair)
        free = signals(straight.environment, block_of(straight, first), epoch, *pair)
        code = heard.pseudorange_m - free.pseudorange_m
        assert (code > 0).all()
        assert (heard.cycles - free.cycles) * free.at.wave_m == pytest.approx(code, abs=0.3)
        late += len(code)
    assert late > 3


def test_windup_is_in_the_rate_as_it_is_in_the_turns():
    """A craft that yaws by 60 deg in 20 s."""
    turning = {"attitude": {"mode": "slew", "profile": [{"t_s": 0.0}, {"t_s": 20.0, "yaw_deg": 60.0}]}}
    _, _, rate, seen = added(range(38, 43), tables=turning, phase_windup=True)
    turns = np.unwrap([s.turns_cyc for s in seen], axis=0, period=1.0)
    assert rate[2] == pytest.approx(derivative(turns, 0.25) * seen[2].at.wave_m, abs=1e-5)
    assert np.abs(rate[2]).max() > 1e-3


def test_satellites_move_as_they_report_however_wrong_their_orbits_are():
    wrong = {"gps_sigma_m": (0.0, 900.0, 900.0), "glonass_sigma_m": (0.0, 900.0, 900.0)}
    plain = craft(interval_s=10.0)
    pairs = block_of(plain).signal[:5].all(axis=0).nonzero()
    off_m, off_mps = [], []
    for right, reported in zip(
        over(plain, pairs, range(5)),
        over(craft({"ephemeris_error": wrong}, 10.0), pairs, range(5)),
        strict=True,
    ):
        off_m.append(reported.pos_ecef_m - right.pos_ecef_m)
        off_mps.append(reported.vel_ecef_mps - right.vel_ecef_mps)
    assert off_mps[2] == pytest.approx(derivative(np.array(off_m), 10.0), abs=1e-5)
    assert np.abs(off_mps[2]).max() > 0.05
