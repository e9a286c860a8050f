"""Which columns of a file a signal's observables are taken from: made-up files, columns told apart."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.files import rinex_obs
from gnss_hil.emulator.receivers.recorded.observables import columns, ranges, there
from gnss_hil.emulator.receivers.recorded.signals import SIGNALS, band_of
from tests.support.rinex_observations import header_line

pytestmark = pytest.mark.verifies(
    "emulator/receivers/recorded/observables.py",
    what="Which codes of a file make up a signal",
    by="made-up files whose columns are told apart by their values; the rule is ours",
    status="modelled",
)


def file(codes, rows, epochs=4):
    """A file of version 3: codes by letter, and of each satellite what it has, value by code."""
    text = header_line("     3.05           OBSERVATION DATA    M", "RINEX VERSION / TYPE")
    for letter, names in codes.items():
        text += header_line(f"{letter}  {len(names):3d} {' '.join(names)}", "SYS / # / OBS TYPES")
    text += header_line("  2024    03    01    00    00    0.0000000     GPS", "TIME OF FIRST OBS")
    text += header_line("", "END OF HEADER")
    for epoch in range(epochs):
        text += f"> 2024 03 01 00 00 {epoch:2d}.0000000  0 {len(rows):2d}\n"
        for name, has in rows.items():
            values = (has.get(code) for code in codes[name[0]])
            text += name + "".join(" " * 16 if v is None else f"{v:14.3f}  " for v in values) + "\n"
    return rinex_obs.parse(text, "x.rnx")


def of(found, name, signal):
    """What one satellite has of a signal in its first epoch: range, then the columns."""
    rows = np.flatnonzero(found.sat == satellites.parse(name))
    range_m, which = ranges(found, SIGNALS[signal])
    return range_m[rows[0]], columns(found, SIGNALS[signal], which[rows], rows)


MIXED = {
    "G": ("C1C", "L1C", "C2W", "L2W", "C2L", "L2L", "C5Q", "L5Q"),
    "R": ("C1P", "L1P", "C1C", "L1C", "C2P", "L2P"),
}
SKY = {
    "G05": {"C1C": 21.0, "L1C": 11.0, "C2W": 22.0, "L2W": 12.0},
    "G10": {"C1C": 21.0, "L1C": 11.0, "C2W": 22.0, "L2W": 12.0, "C2L": 23.0, "L2L": 13.0, "C5Q": 25.0},
    "R03": {"C1P": 31.0, "L1P": 41.0, "C1C": 32.0, "L1C": 42.0, "C2P": 33.0, "L2P": 43.0},
    "R07": {"C1P": 31.0, "L1P": 41.0, "C2P": 33.0, "L2P": 43.0},
}


@pytest.mark.parametrize(
    ("name", "signal", "range_m", "cycles"),
    [
        ("G05", "L1CA", 21.0, 11.0), ("G05", "L2P", 22.0, 12.0), ("G10", "L2C", 23.0, 13.0),
        ("R03", "L1OF", 32.0, 42.0), ("R07", "L1OF", 31.0, 41.0), ("R03", "L2OF", 33.0, 43.0),
    ],
)  # fmt: skip
def test_a_systems_codes_are_its_own(name, signal, range_m, cycles):
    """GLONASS's C1P says nothing of GPS; of two slots each may have another code of one signal."""
    found_m, seen = of(file(MIXED, SKY), name, signal)
    assert (found_m, seen.phase.cycles[0]) == (range_m, cycles)


def test_a_signal_is_there_where_a_satellite_sends_it():
    found = file(MIXED, SKY)

    def count(signal):
        return np.count_nonzero(there(found, SIGNALS[signal]))

    assert [count(s) for s in ("L1CA", "L1P", "L2P", "L2C", "L5", "L1OF", "L2OF")] == [8, 0, 8, 4, 4, 8, 8]


def test_another_systems_code_of_that_name_is_none():
    """C1P stands in the header, of GLONASS alone: GPS has no code P on L1 by it."""
    assert not there(file(MIXED, SKY), SIGNALS["L1P"]).any()


def test_a_code_without_a_phase_has_the_carriers():
    codes = {"G": ("C1W", "L1C", "D1C", "C2W", "L2L")}
    found = file(codes, {"G05": {"C1W": 21.0, "L1C": 11.0, "D1C": -500.0, "C2W": 22.0, "L2L": 12.0}})
    _, first = of(found, "G05", "L1P")
    assert (first.phase.cycles[0], first.doppler[0]) == (11.0, -500.0)
    assert [(phase.band, phase.cycles[0]) for phase in first.others if phase.band == "2"] == [("2", 12.0)]
    _, second = of(found, "G05", "L2P")
    assert second.phase.cycles[0] == 12.0
    assert np.isnan(second.doppler[0])


def test_a_name_that_is_hardly_filled_counts_after_one_that_is():
    """A receiver changes its tracking: one value of C2X in ten of C2L; where both are, the order counts."""
    few = file({"G": ("C1C", "C2X", "C2L")}, {"G05": {"C1C": 1.0, "C2X": 2.0, "C2L": 3.0}}, epochs=10)
    assert of(few, "G05", "L2C")[0] == 2.0
    few.obs["C2X"][1:] = np.nan
    assert of(few, "G05", "L2C")[0] == 3.0


def test_the_band_of_a_name():
    assert [band_of(name) for name in ("L1", "L1C", "LA", "L2W", "C5Q")] == ["1", "1", "1", "2", "5"]
