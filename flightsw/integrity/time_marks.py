"""Does a time mark follow from those before it?

Epochs are equally far apart: a mark is believed if its time has advanced by as many intervals as its number.
One that has not may still be right, after a gap in a recording: then satellites are where they must be at
that time. One that steps by less than they can show is not believed. Nor is one that goes back: a run that
begins anew is told to the flight software as such. Small steps, a millisecond at most, are of marks that
jitter, or that a receiver's clock shows. Marks of GPS time that have been steady are on a line: one that is
beside it, by a step or little by little, is believed only when that lasts, and in doubt by as much until it
has lasted for minutes. Another clock, or other leap seconds, are believed when they last.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from gnss_hil.flightsw.records.epoch import Mark

TOLERANCE_NS = 10**6
"""What a receiver's clock, where it shows the marks, may step by; 8 m along a low orbit."""

STEADY_NS, STEADY, LASTING = 10**4, 10, 3
"""Marks of GPS time that are beside their line by less than this, 8 cm along a low orbit, so many times in a
row are steady. What is odd about the next is believed after so many that were not."""

REMEMBERED = 1000
"""Marks that the line follows: it learns a rate of its own within them, and none that changes."""

SHOWN_NS = 250 * 10**6
"""Satellites move a kilometre in this time: a step as long shows in their reports."""

DOUBTED_S = 300.0
"""Marks that do not follow for so long are believed: else a wrong first one would never be got rid of."""


@dataclass(frozen=True, slots=True)
class Line:
    """The straight line that marks are on.

    interval_ns   between epochs
    beside_ns     by how much it is later than the last mark believed
    marks         that it was fitted to, REMEMBERED at most
    """

    interval_ns: float
    beside_ns: float = 0.0
    marks: int = 2

    def off_ns(self, epochs: int, dt_ns: int) -> float:
        """By how much a mark, so long after the last, is later than it should be."""
        return dt_ns - epochs * self.interval_ns - self.beside_ns

    def beside(self, off_ns: float) -> Line:
        """The same line, with a mark that does not belong to it."""
        return replace(self, beside_ns=-off_ns)

    def fitted(self, epochs: int, off_ns: float) -> Line:
        """With a mark that does: least squares of all until there are many, then of the last ones."""
        n = min(self.marks + 1, REMEMBERED)
        level, rate = 2 * (2 * n - 1) / (n * (n + 1)), 6 / (n * (n + 1))
        return Line(self.interval_ns + rate * off_ns / epochs, (level - 1) * off_ns, n)


@dataclass(frozen=True, slots=True)
class TimeMarks:
    """last          mark believed, None before the first
    interval_ns   between epochs; 0 until two advances were the same
    advance_ns    of the last two believed, for an epoch
    refused       marks in a row
    line          that marks are on; it counts where they are GPS time
    doubted       marks in a row that were refused or believed beside their line
    """

    last: Mark | None = None
    interval_ns: int = 0
    advance_ns: int = 0
    refused: int = 0
    line: Line | None = None
    doubted: int = 0

    @property
    def doubt_s(self) -> float:
        """How far beside its line the last mark is that was believed all the same."""
        if self.line is None or self.doubted <= self.refused:
            return 0.0
        return abs(self.line.beside_ns) * 1e-9


def advanced(marks: TimeMarks, mark: Mark, satellites_agree: bool) -> tuple[TimeMarks, bool]:
    """After a mark, and whether it is believed.

    satellites_agree   most of what they report is where they were predicted to be at that time
    """
    last = marks.last
    if last is None:
        return TimeMarks(mark), True
    epochs, dt_ns = mark.epoch - last.epoch, mark.t_ns - last.t_ns
    if epochs > 0 and dt_ns > 0 and (_alike(mark, last) or marks.refused >= LASTING):
        found = _followed(marks, mark, epochs, dt_ns)
        if found is not None:
            return found, True
        if abs(dt_ns - epochs * marks.interval_ns) > SHOWN_NS and satellites_agree:
            return TimeMarks(mark, marks.interval_ns, marks.advance_ns), True
    refused = replace(marks, refused=marks.refused + 1, doubted=marks.doubted + 1)
    return (TimeMarks(mark), True) if _long(refused) else (refused, False)


def follows(marks: TimeMarks, mark: Mark) -> bool:
    """Whether a mark is the one to be expected: of the same session, on time for its number, and nothing new
    about it. Satellites are not asked, nor is it believed because nothing else was."""
    last = marks.last
    if last is None or marks.interval_ns == 0 or mark.session != last.session or mark.epoch <= last.epoch:
        return False
    return (
        _alike(mark, last)
        and _followed(marks, mark, mark.epoch - last.epoch, mark.t_ns - last.t_ns) is not None
    )


def _alike(mark: Mark, last: Mark) -> bool:
    """Whether two marks are of one clock, with leap seconds that one insertion explains."""
    return mark.clock == last.clock and abs(mark.leap - last.leap) <= 1


def _long(marks: TimeMarks) -> bool:
    """Whether marks have been doubted for so long that they are to be believed."""
    return marks.doubted * (marks.interval_ns or 10**9) > DOUBTED_S * 1e9


def _followed(marks: TimeMarks, mark: Mark, epochs: int, dt_ns: int) -> TimeMarks | None:
    """After a mark that is on time, or nearly; None if it is not."""
    line, advance_ns = marks.line, dt_ns // epochs
    if line is None or mark.clock or line.marks < STEADY:
        return _stepped(marks, mark, epochs, dt_ns)
    off_ns = line.off_ns(epochs, dt_ns)
    on = TimeMarks(mark, marks.interval_ns, advance_ns, line=line.fitted(epochs, off_ns))
    if abs(off_ns) <= STEADY_NS:
        return on
    lasting = marks.refused >= LASTING or marks.doubted > marks.refused
    if abs(off_ns) > TOLERANCE_NS or not lasting:
        return None
    doubted = replace(on, line=line.beside(off_ns), doubted=marks.doubted + 1)
    return replace(on, line=Line(line.interval_ns)) if _long(doubted) else doubted


def _stepped(marks: TimeMarks, mark: Mark, epochs: int, dt_ns: int) -> TimeMarks | None:
    """Likewise, where there is no line: by the last one alone. One begins where marks are on it."""
    advance_ns = dt_ns // epochs
    if not marks.interval_ns:
        same = abs(advance_ns - marks.advance_ns) <= TOLERANCE_NS
        return TimeMarks(mark, advance_ns if same else 0, advance_ns)
    if abs(dt_ns - epochs * marks.interval_ns) > TOLERANCE_NS:
        return None
    line = marks.line or Line(marks.interval_ns)
    off_ns = line.off_ns(epochs, dt_ns)
    steady = abs(off_ns) <= STEADY_NS
    line = line.fitted(epochs, off_ns) if steady else Line(marks.interval_ns)
    return TimeMarks(mark, marks.interval_ns, advance_ns, line=line)
