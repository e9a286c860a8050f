"""Does a time mark follow from those before it?

Epochs are equally far apart: a mark is believed if its time has advanced by as many intervals as its number.
One that has not may still be right, after a gap in a recording: then satellites are where they must be at
that time. One that steps by less than they can show is not believed. Nor is one that goes back: a run that
begins anew is told to the flight software as such.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from gnss_hil.flightsw.records.epoch import Mark

TOLERANCE_NS = 10**6
"""What a receiver's clock, where it shows the marks, may step by; 8 m along a low orbit."""

SHOWN_NS = 250 * 10**6
"""Satellites move a kilometre in this time: a step as long shows in their reports."""

DOUBTED_S = 300.0
"""Marks that do not follow for so long are believed: else a wrong first one would never be got rid of."""


@dataclass(frozen=True, slots=True)
class TimeMarks:
    """last           mark believed, None before the first
    interval_ns    between epochs; 0 until two advances were the same
    advance_ns     of the last two believed, for an epoch
    refused        marks in a row
    """

    last: Mark | None = None
    interval_ns: int = 0
    advance_ns: int = 0
    refused: int = 0


def advanced(marks: TimeMarks, mark: Mark, satellites_agree: bool) -> tuple[TimeMarks, bool]:
    """After a mark, and whether it is believed.

    satellites_agree   most of what they report is where they were predicted to be at that time
    """
    last = marks.last
    if last is None:
        return TimeMarks(mark), True
    epochs, dt_ns = mark.epoch - last.epoch, mark.t_ns - last.t_ns
    if epochs > 0 and dt_ns > 0:
        step_ns = dt_ns - epochs * marks.interval_ns
        if marks.interval_ns == 0 or abs(step_ns) <= TOLERANCE_NS:
            return _followed(marks, mark, dt_ns // epochs), True
        if abs(step_ns) > SHOWN_NS and satellites_agree:
            return TimeMarks(mark, marks.interval_ns, marks.advance_ns), True
    refused = marks.refused + 1
    if refused * (marks.interval_ns or 10**9) > DOUBTED_S * 1e9:
        return TimeMarks(mark), True
    return replace(marks, refused=refused), False


def _followed(marks: TimeMarks, mark: Mark, advance_ns: int) -> TimeMarks:
    same = abs(advance_ns - marks.advance_ns) <= TOLERANCE_NS
    return TimeMarks(mark, marks.interval_ns or (advance_ns if same else 0), advance_ns)
