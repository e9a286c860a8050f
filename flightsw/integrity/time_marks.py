"""Does a time mark follow from those before it?

Epochs are equally far apart: a mark is believed if its time has advanced by as many intervals as its number.
One that has not may still be right, after a gap in a recording: then satellites are where they must be at
that time. One that steps by less than they can show is not believed. Nor is one that goes back: a run that
begins anew is told to the flight software as such. Small steps, a millisecond at most, are of marks that
jitter, or that a receiver's clock shows; of marks that have been steady they are believed when they last. So
is another clock, or are other leap seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from gnss_hil.flightsw.records.epoch import Mark

TOLERANCE_NS = 10**6
"""What a receiver's clock, where it shows the marks, may step by; 8 m along a low orbit."""

STEADY_NS, STEADY, LASTING = 10**4, 10, 3
"""Marks of GPS time that stepped by less than this, 8 cm along a low orbit, so many times in a row are
steady. What is odd about the next is believed after so many that were not."""

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
    steady         marks in a row
    """

    last: Mark | None = None
    interval_ns: int = 0
    advance_ns: int = 0
    refused: int = 0
    steady: int = 0


def advanced(marks: TimeMarks, mark: Mark, satellites_agree: bool) -> tuple[TimeMarks, bool]:
    """After a mark, and whether it is believed.

    satellites_agree   most of what they report is where they were predicted to be at that time
    """
    last = marks.last
    if last is None:
        return TimeMarks(mark), True
    epochs, dt_ns = mark.epoch - last.epoch, mark.t_ns - last.t_ns
    if epochs > 0 and dt_ns > 0 and (_alike(mark, last) or marks.refused >= LASTING):
        step_ns = dt_ns - epochs * marks.interval_ns
        if marks.interval_ns == 0 or abs(step_ns) <= _tolerance_ns(marks, mark):
            return _followed(marks, mark, dt_ns // epochs, abs(step_ns) <= STEADY_NS), True
        if abs(step_ns) > SHOWN_NS and satellites_agree:
            return TimeMarks(mark, marks.interval_ns, marks.advance_ns), True
    refused = marks.refused + 1
    if refused * (marks.interval_ns or 10**9) > DOUBTED_S * 1e9:
        return TimeMarks(mark), True
    return replace(marks, refused=refused), False


def follows(marks: TimeMarks, mark: Mark) -> bool:
    """Whether a mark is the one to be expected: of the same session, on time for its number, and nothing new
    about it. Satellites are not asked, nor is it believed because nothing else was."""
    last = marks.last
    if last is None or marks.interval_ns == 0 or mark.session != last.session or mark.epoch <= last.epoch:
        return False
    step_ns = mark.t_ns - last.t_ns - (mark.epoch - last.epoch) * marks.interval_ns
    return _alike(mark, last) and abs(step_ns) <= _tolerance_ns(marks, mark)


def _alike(mark: Mark, last: Mark) -> bool:
    """Whether two marks are of one clock, with leap seconds that one insertion explains."""
    return mark.clock == last.clock and abs(mark.leap - last.leap) <= 1


def _tolerance_ns(marks: TimeMarks, mark: Mark) -> int:
    """What the next mark may step by."""
    odd = mark.clock == 0 and marks.steady >= STEADY and marks.refused < LASTING
    return STEADY_NS if odd else TOLERANCE_NS


def _followed(marks: TimeMarks, mark: Mark, advance_ns: int, steadily: bool) -> TimeMarks:
    same = abs(advance_ns - marks.advance_ns) <= TOLERANCE_NS
    interval_ns = marks.interval_ns or (advance_ns if same else 0)
    return TimeMarks(mark, interval_ns, advance_ns, steady=marks.steady + 1 if steadily else 0)
