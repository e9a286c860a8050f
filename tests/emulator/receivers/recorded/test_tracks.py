"""Observations of a file as rows of channels: against functions whose derivatives are known."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS
from gnss_hil.emulator.receivers.recorded.tracks import arcs, decibels, rates, tracks

pytestmark = pytest.mark.verifies(
    "emulator/receivers/recorded/tracks.py",
    "emulator/receivers/recorded/signals.py",
    "emulator/receivers/recorded/receiver.py",
    "emulator/assemble/recorded.py",
    what="Observations of a real receiver as channels",
    by="which channel, where a track ends, what a gap is: rules of ours on made-up tracks",
    status="modelled",
)

L1_WAVE_M = 299_792_458.0 / 1_575.42e6
L2_WAVE_M = 299_792_458.0 / 1_227.6e6
INTERVAL_S = 10.0


@dataclass
class File:
    """What `tracks` reads of a file's observations."""

    epoch: np.ndarray
    sat: np.ndarray
    obs: dict
    lli: dict = field(default_factory=dict)
    origin: str = "test.10o"
    frequencies: dict = field(default_factory=dict)
    strength_unit: str = ""

    @property
    def t_ns(self):
        return (INTERVAL_S * 1e9 * np.arange(self.epoch.max() + 1)).astype(np.int64)

    @property
    def header(self):
        return self


def gps(number):
    return int(satellites.index(satellites.GPS, number))


def low_orbit_range_m(t_s):
    """Of the size and speed of a range from a low orbit: 7 km/s at most, a period of 94 minutes."""
    return 2.2e7 + 6.3e6 * np.sin(2 * np.pi * t_s / 5640 + 0.4)


def low_orbit_rate_mps(t_s):
    w = 2 * np.pi / 5640
    return 6.3e6 * w * np.cos(w * t_s + 0.4)


def one_satellite(epochs, **more):
    t_s = INTERVAL_S * np.asarray(epochs)
    range_m = low_orbit_range_m(t_s)
    obs = {"C1": range_m, "L1": range_m / L1_WAVE_M + 12345678.25}
    return File(np.asarray(epochs), np.full(len(epochs), gps(7)), {**obs, **more})


def played(file, signals=("L1CA",), channels=12):
    epochs = np.arange(file.epoch.max() + 1)
    return tracks(file, [SIGNALS[name] for name in signals], epochs, channels, file.frequencies)


@pytest.mark.verifies(
    "emulator/receivers/recorded/tracks.py",
    "emulator/receivers/recorded/signals.py",
    "emulator/receivers/recorded/receiver.py",
    "emulator/assemble/recorded.py",
    what="Range rates of a real receiver, from its phases",
    by="closed derivatives",
    status="validated",
)
def test_rates_come_from_the_phase_to_a_millimetre_a_second():
    rows = played(one_satellite(np.arange(60)))
    assert len(rows) == 60
    expected = low_orbit_rate_mps(INTERVAL_S * rows.epoch)
    assert np.abs(rows.rate_mps - expected).max() < 1e-3


@pytest.mark.parametrize(
    ("phase", "wave_m"),
    [("L1W", L1_WAVE_M), ("L1C", L1_WAVE_M), ("L2W", L2_WAVE_M), ("L5Q", 299_792_458.0 / 1_176.45e6)],
)  # fmt: skip
def test_any_phase_of_a_satellite_tells_the_rate(phase, wave_m):
    """Of the code alone it would be wrong by the noise of ranges, decimetres a second."""
    epochs = np.arange(60)
    range_m = low_orbit_range_m(INTERVAL_S * epochs)
    noise_m = np.random.default_rng(1).normal(0.0, 1.0, 60)
    obs = {"C1W": range_m + noise_m, phase: range_m / wave_m + 1234567.25}
    rows = played(File(epochs, np.full(60, gps(7)), obs), ("L1P",))
    assert np.abs(rows.rate_mps - low_orbit_rate_mps(INTERVAL_S * rows.epoch)).max() < 1e-3
    assert np.isfinite(rows.phase_cyc).all() == (phase[1] == "1"), "another carrier's phase is not its own"


def test_where_the_own_phase_slips_another_carriers_tells_the_rate():
    epochs = np.arange(9)
    range_m = low_orbit_range_m(INTERVAL_S * epochs)
    noise_m = np.random.default_rng(1).normal(0.0, 1.0, 9)
    obs = {"C1C": range_m + noise_m, "L1C": range_m / L1_WAVE_M, "L2W": range_m / L2_WAVE_M}
    file = File(epochs, np.full(9, gps(7)), obs, {"L1C": np.array([0, 0, 0, 0, 0, 0, 1, 1, 1])})
    rows = played(file)
    assert np.abs(rows.rate_mps - low_orbit_rate_mps(INTERVAL_S * rows.epoch)).max() < 2e-2


def test_short_arcs_have_the_rate_their_length_allows():
    """Of two points a straight line is left: wrong by half a step's acceleration at its ends."""
    for length, limit in ((2, 45.0), (3, 1.0), (4, 0.02)):
        rows = played(one_satellite(np.arange(length)))
        assert np.abs(rows.rate_mps - low_orbit_rate_mps(INTERVAL_S * rows.epoch)).max() < limit


def test_after_a_slip_the_code_tells_the_rate_until_the_phase_can():
    file = one_satellite(np.arange(8))
    file.lli["L1"] = np.array([0, 0, 0, 0, 0, 0, 1, 0])
    rows = played(file)
    assert np.abs(rows.rate_mps - low_orbit_rate_mps(INTERVAL_S * rows.epoch)).max() < 0.05


def test_glonass_waves_have_their_own_lengths():
    number = 3
    wave_m = 299_792_458.0 / (1_602.0e6 - 7 * 562.5e3)
    epochs = np.arange(20)
    range_m = low_orbit_range_m(INTERVAL_S * epochs)
    sat = np.full(20, int(satellites.index(satellites.GLONASS, number)))
    file = File(epochs, sat, {"C1": range_m, "L1": range_m / wave_m}, frequencies={number: -7})
    rows = played(file, ("L1OF",))
    assert np.abs(rows.rate_mps - low_orbit_rate_mps(INTERVAL_S * rows.epoch)).max() < 1e-3
    file.frequencies.clear()
    assert not len(played(file, ("L1OF",)))


def test_a_lone_observation_has_no_rate_and_is_dropped_and_counted():
    rows = played(one_satellite([0, 1, 2, 7]))
    assert rows.epoch.tolist() == [0, 1, 2]
    assert rows.dropped == 1


def test_a_doppler_of_the_file_goes_before_the_phase():
    rows = played(one_satellite(np.arange(5), D1=np.full(5, 1000.0)))
    assert np.allclose(rows.rate_mps, -1000.0 * L1_WAVE_M)


def test_lost_lock_and_gaps_begin_arcs_and_count_slips():
    file = one_satellite([0, 1, 2, 3, 4, 6, 7])
    file.lli["L1"] = np.array([1, 0, 0, 1, 0, 0, 0])
    rows = played(file)
    assert rows.slips.tolist() == [1, 1, 1, 2, 2, 3, 3]
    first = rows.phase_cyc[[0, 3, 5]]
    assert ((first >= 0) & (first < 1)).all()


def test_within_an_arc_the_phase_keeps_what_it_counts():
    rows = played(one_satellite(np.arange(20)))
    apart = rows.phase_cyc - rows.range_m / L1_WAVE_M
    assert np.ptp(apart) < 1e-6 * np.abs(apart).max()


def test_arcs_of_several_satellites():
    sat = np.array([1, 1, 1, 2, 2, 2])
    epoch = np.array([0, 1, 3, 3, 4, 5])
    phased = np.array([1, 1, 1, 1, 1, 0], bool)
    assert arcs(sat, epoch, phased, np.zeros(6, bool)).tolist() == [0, 0, 1, 2, 2, 3]


def test_a_pair_keeps_its_channel_and_two_signals_have_two():
    epoch, sat = np.repeat(np.arange(4), 2), np.tile([gps(3), gps(9)], 4)
    t_s = INTERVAL_S * epoch
    obs = {name: low_orbit_range_m(t_s) / scale for name, scale in
           (("P1", 1), ("P2", 1), ("L1", L1_WAVE_M), ("L2", 0.2442))}  # fmt: skip
    rows = played(File(epoch, sat, obs), ("L1P", "L2P"))
    seats = {(s, g): set(rows.channel[(rows.sat == s) & (rows.signal == g)].tolist())
             for s in (gps(3), gps(9)) for g in set(rows.signal.tolist())}  # fmt: skip
    assert len(seats) == 4
    assert all(len(places) == 1 for places in seats.values())
    assert len(set.union(*seats.values())) == 4


def test_who_finds_no_channel_is_counted():
    epoch, sat = np.repeat(np.arange(3), 3), np.tile([gps(3), gps(9), gps(11)], 3)
    t_s = INTERVAL_S * epoch
    obs = {"C1": low_orbit_range_m(t_s), "L1": low_orbit_range_m(t_s) / L1_WAVE_M}
    rows = played(File(epoch, sat, obs), channels=2)
    assert set(rows.sat.tolist()) == {gps(3), gps(9)}
    assert rows.dropped == 3


def test_strengths_are_dbhz_or_ratios_of_voltage():
    assert decibels(np.array([44.0, 51.5, np.nan]))[:2].tolist() == [44.0, 51.5]
    assert np.allclose(decibels(np.array([1000.0, 100.0])), [60.0, 40.0])
    assert np.isnan(decibels(np.array([1000.0, 100.0, 0.5]))[2])


@pytest.mark.parametrize("unknown", [99.0, 99.999, 9999.999, -1.0])
@pytest.mark.parametrize("often", [1, 30])
def test_a_value_for_unknown_is_left_out_and_no_unit(unknown, often):
    """Whether it is written once or in most rows, with the header's unit or without."""
    known = np.linspace(35.0, 52.0, 25)
    for unit in ("DBHZ", ""):
        found = decibels(np.append(known, np.full(often, unknown)), unit)
        assert found[:25].tolist() == known.tolist()
        assert np.isnan(found[25:]).all()


def test_the_headers_unit_decides():
    assert np.isnan(decibels(np.array([300.0, 100.0]), "DBHZ")).all()


def test_strengths_left_out_are_counted_where_they_are_played():
    strength = np.linspace(40.0, 45.0, 20)
    strength[7] = 99.0
    rows = played(one_satellite(np.arange(20), S1=strength))
    assert rows.doubtful == 1
    assert np.isnan(rows.cn0_dbhz[7])
    assert rows.dropped == 0


def test_a_missing_signal_is_told_with_what_there_is():
    with pytest.raises(
        ScenarioError, match=r"test\.10o: no L2P pseudorange \(C2W, .*P2\); of gps it has C1, L1"
    ):
        played(one_satellite(np.arange(3)), ("L2P",))
    with pytest.raises(ScenarioError, match=r"no L1OF pseudorange \(.*\): no satellite of glonass"):
        played(one_satellite(np.arange(3)), ("L1OF",))


def test_rates_of_uneven_arcs_stay_inside_them():
    t_s = np.arange(12) * INTERVAL_S
    phase = np.where(t_s < 60, 3.0 * t_s, 1e6 - 5.0 * t_s)
    found = rates(np.repeat([0, 1], 6), t_s, phase)
    assert np.allclose(found, np.repeat([3.0, -5.0], 6))
