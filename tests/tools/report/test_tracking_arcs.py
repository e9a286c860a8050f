"""The assignment in time from small tables made by hand; seconds stand for nanoseconds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.tools.report.tracking_arcs import Holds, Lanes, bridged, holds, lanes


def stretches(rows, break_ns: int = 0) -> list[tuple[int, int, int, int]]:
    """(receiver, satellite, begin, end) of measurements (t, receiver, satellite) an epoch of 10 apart."""
    t, receiver, satellite = np.array(rows, np.int64).reshape(-1, 3).T
    h = bridged(holds(t, receiver, satellite, 10), break_ns)
    return list(zip(h.receiver.tolist(), h.satellite.tolist(), h.begin_ns.tolist(), h.end_ns.tolist(),
                    strict=True))  # fmt: skip


def test_a_satellite_that_changes_its_antenna_has_two_stretches_that_meet():
    rows = [(t, 1, 7) for t in (0, 10, 20)] + [(t, 3, 7) for t in (30, 40)]
    assert stretches(rows[::-1]) == [(1, 7, 0, 30), (3, 7, 30, 50)]


def test_a_missed_epoch_is_a_break_unless_bridged():
    rows = [(t, 2, 5) for t in (0, 10, 30, 40)]
    assert stretches(rows) == [(2, 5, 0, 20), (2, 5, 30, 50)]
    assert stretches(rows, break_ns=10) == [(2, 5, 0, 50)]


def test_two_channels_of_a_receiver_on_one_satellite_are_one_stretch():
    assert stretches([(0, 1, 9), (0, 1, 9), (10, 1, 9)]) == [(1, 9, 0, 20)]


def test_nothing_measured_is_no_stretch():
    assert stretches([]) == []


def as_rows(cut: Lanes) -> list[tuple]:
    h = cut.holds
    columns = (h.satellite, h.begin_ns, h.end_ns, h.receiver, cut.share, cut.lane)
    return sorted(zip(*(column.tolist() for column in columns), strict=True))


def made(*rows) -> Holds:
    return Holds(*np.array(rows, np.int64).reshape(-1, 4).T)


def test_a_satellite_on_two_antennas_at_once_splits_its_row_for_that_time():
    cut = lanes(made((1, 7, 0, 50), (3, 7, 30, 80), (2, 8, 0, 80)))
    assert as_rows(cut) == [
        (7, 0, 30, 1, 1, 0), (7, 30, 50, 1, 2, 0), (7, 30, 50, 3, 2, 1), (7, 50, 80, 3, 1, 0),
        (8, 0, 80, 2, 1, 0),
    ]  # fmt: skip


def test_four_antennas_on_one_satellite_have_a_quarter_each():
    cut = lanes(made(*((receiver, 7, 0, 60) for receiver in (4, 2, 1, 3))))
    assert as_rows(cut) == [(7, 0, 60, receiver, 4, receiver - 1) for receiver in (1, 2, 3, 4)]


def test_no_stretch_no_lane():
    assert len(lanes(made()).holds) == 0


@pytest.mark.verifies(
    "tools/report/tracking_arcs.py",
    "tools/report/assignment.py",
    what="Report: which antenna held which satellite",
    by="sets counted instant by instant, by hypothesis",
    status="validated",
)
@given(st.lists(st.tuples(st.integers(1, 4), st.integers(0, 2), st.integers(0, 12)), max_size=60))
def test_lanes_cover_every_stretch_once_and_never_each_other(rows):
    t, receiver, satellite = np.array([(t * 10, r, s) for r, s, t in rows], np.int64).reshape(-1, 3).T
    cut = lanes(holds(t, receiver, satellite, 10))
    seen = set()
    for sat, begin, end, rx, share, lane in as_rows(cut):
        for now in range(begin, end, 10):
            antennas = {r for r, s, k in rows if s == sat and k * 10 == now}
            assert share == len(antennas) and lane == sorted(antennas).index(rx)
            assert (sat, now, lane) not in seen
            seen.add((sat, now, lane))
    assert len(seen) == len(set(rows))
