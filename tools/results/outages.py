"""Epochs without a fix: why, as the flight software says it, when, and what could be known besides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.values import VALUES

Columns = Mapping[str, NDArray]

CONVERGENCE_S = 60.0
"""From the first fix to the first epoch of the figures after convergence. Receivers that start cold bring in
their satellites one after the other within half a minute of the first fix; what is commanded then is
collected within the rest."""

INCOMPLETE, SILENT = "INCOMPLETE_BLOCK", "NOT_REPORTED"
"""What the flight software cannot say itself: frames that its mode promised are missing or its block
contradicts itself; no NAV_STATUS came."""

_FIX = 0  # NoFix
REASONS = (*(label for raw, label in VALUES["NoFix"].items() if raw != _FIX), INCOMPLETE, SILENT)


def reason_names(no_fix: NDArray) -> list[str]:
    """Why there is no fix, of navigation blocks (n,) without a valid one: the contract's labels; a number
    that has none is named as such."""
    labels = VALUES["NoFix"] | {_FIX: INCOMPLETE}
    return [labels.get(int(raw), f"UNKNOWN_{int(raw)}") for raw in no_fix]


def reasons(fixes: Columns, epochs: int) -> dict[str, int]:
    """Epochs without a fix by reason, all that are known and those that came; with the fixes they are
    `epochs`."""
    counted = dict.fromkeys(REASONS, 0)
    reported = 0
    if fixes:
        reported = len(fixes["valid"])
        raw, count = np.unique(fixes["no_fix"][~fixes["valid"]], return_counts=True)
        for name, number in zip(reason_names(raw), count.tolist(), strict=True):
            counted[name] = counted.get(name, 0) + number
    counted[SILENT] += max(epochs - reported, 0)
    return counted


@dataclass(frozen=True, slots=True, eq=False)
class Stretches:
    """Stretches (k,) of epochs without a fix, in order.

    begin_ns   first epoch of each, GPS time
    epochs     how many
    reason     of most of its epochs
    """

    begin_ns: I64
    epochs: I64
    reason: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.begin_ns)


def stretches(marks_ns: I64, fixes: Columns, interval_ns: int) -> Stretches:
    """Of time marks (e,), those lost among them counted by their distance; of navigation blocks.

    The first stretch of a cold start begins with the first mark.
    """
    if not len(marks_ns):
        none = np.zeros(0, np.int64)
        return Stretches(none, none, ())
    fix_ns = fixes["t_ns"][fixes["valid"]] if fixes else np.zeros(0, np.int64)
    ends = np.r_[marks_ns[0] - interval_ns, np.unique(fix_ns), marks_ns[-1] + interval_ns]
    lacking = np.round(np.diff(ends) / interval_ns).astype(np.int64) - 1
    at = np.flatnonzero(lacking > 0)
    begin_ns = ends[at] + interval_ns
    return Stretches(begin_ns, lacking[at], tuple(_prevailing(fixes, begin_ns, ends[at + 1])))


def _prevailing(fixes: Columns, begin_ns: I64, end_ns: I64) -> list[str]:
    """The reason of most epochs of each stretch [begin, end)."""
    if not fixes:
        return [SILENT] * len(begin_ns)
    first, last = np.searchsorted(fixes["t_ns"], begin_ns), np.searchsorted(fixes["t_ns"], end_ns)
    found = []
    for a, b in zip(first, last, strict=True):
        raw, count = np.unique(fixes["no_fix"][a:b], return_counts=True)
        found.append(reason_names(raw[[count.argmax()]])[0] if len(raw) else SILENT)
    return found


def first_fix_ns(fixes: Columns) -> int | None:
    """GPS time of the first fix; None if there is none."""
    if not fixes or not fixes["valid"].any():
        return None
    return int(fixes["t_ns"][fixes["valid"]][0])


def outages(found: Stretches, first_ns: int | None, interval_ns: int) -> dict[str, Any]:
    """Figures of the stretches after the first fix: the time to it is a figure of its own."""
    epochs = found.epochs[found.begin_ns > first_ns] if first_ns is not None else np.zeros(0, np.int64)
    longest_s = float(epochs.max(initial=0)) * interval_ns / NS_PER_S
    return {"count": len(epochs), "epochs": int(epochs.sum()), "longest_s": longest_s}


def without_fix(timeline: Columns, fixes: Columns) -> Bool:
    """(e,) rows of the timeline whose epoch has no valid fix."""
    marks_ns = timeline.get("t_ns", np.zeros(0, np.int64))
    return ~np.isin(marks_ns, fixes["t_ns"][fixes["valid"]]) if fixes else np.ones(len(marks_ns), bool)
