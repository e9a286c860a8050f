"""Which of many broadcast ephemerides holds when."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64, Bool

BEGUN_MINUTE_NS = 30 * gpstime.NS_PER_S
"""Ephemerides are chosen by the middle of each whole minute; one valid in a part of it serves all of it."""


def latest_of_each(number: I64, reference_ns: I64, uploaded: F64) -> I64:
    """Rows to keep, sorted by satellite and reference time: of equal ones the last uploaded, the last read.

    number        (m,) PRN or slot
    reference_ns  (m,) time of ephemeris [ns]
    uploaded      (m,) anything that grows with the time of upload
    """
    order = np.lexsort((np.arange(len(number)), uploaded, reference_ns, number))
    n, t = number[order], reference_ns[order]
    last = np.append((n[1:] != n[:-1]) | (t[1:] != t[:-1]), True)
    return order[last]


def nearest_valid(
    number: I64, reference_ns: I64, valid_ns: I64, wanted: I64, moments_ns: I64
) -> tuple[I64, Bool]:
    """The ephemeris that holds for each satellite at each moment: the nearest valid one, of two the later.

    number        (m,) satellite of each ephemeris, sorted, with
    reference_ns  (m,) ascending reference times and
    valid_ns      (m,) how far from them it may be used [ns], but for BEGUN_MINUTE_NS
    wanted        (n,) satellites, each with one ephemeris at least
    moments_ns    (s,) middles of minutes [ns]
    returns       (s, n) row, and whether it is valid; rows of no valid one are those of the nearest
    """
    rows = np.empty((len(moments_ns), len(wanted)), np.int64)
    valid = np.empty(rows.shape, bool)
    for column, satellite in enumerate(wanted):
        start, end = np.searchsorted(number, (satellite, satellite + 1))
        away_ns = np.abs(moments_ns[:, None] - reference_ns[start:end])
        usable = away_ns <= valid_ns[start:end] + BEGUN_MINUTE_NS
        # Valid before invalid, then near before far; reversed: of two equal ones the later is met first.
        key = np.where(usable, away_ns, away_ns + np.iinfo(np.int64).max // 2)[:, ::-1]
        pick = end - start - 1 - np.argmin(key, axis=1)
        rows[:, column] = start + pick
        valid[:, column] = usable[np.arange(len(moments_ns)), pick]
    return rows, valid
