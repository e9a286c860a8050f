"""The live view as lines for a window: a pure function of where the run stands and how large the window is.

What has no room is left out from the least important on: columns of the channel tables, then channels, which
are then counted ("+3 more").
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.live.chart import chart
from gnss_hil.tools.live.screen import GAP, Line, Span, beside, fitted, line, parted, plain, wrapped
from gnss_hil.tools.live.summary import CraftSummary, FaultsSummary, RunSummary

_LOCK = VALUES["Lock"]
_FULL = "FULL"


@dataclass(frozen=True, slots=True)
class Cell:
    """One channel of one antenna of a craft."""

    craft: CraftSummary
    antenna: int
    channel: int

    def seen(self, name: str):
        return getattr(self.craft.snapshot, name)[self.antenna, self.channel]

    def track(self, name: str) -> int:
        return int(getattr(self.craft.bus.tracks, name)[self.antenna, self.channel])

    @property
    def delivers(self) -> bool:
        return self.track("sat") >= 0

    @property
    def age_s(self) -> float:
        """How long the satellite has come without a gap."""
        return (self.craft.snapshot.epoch - self.track("since")) * self.craft.interval_s

    @property
    def state(self) -> str:
        """Its lock; ASKED: commanded to a satellite that does not come yet; "-": silent."""
        if self.delivers:
            lock = self.seen("lock")
            return "?" if math.isnan(lock) else _LOCK.get(int(lock), str(int(lock)))
        return "ASKED" if self.track("asked") >= 0 else "-"

    @property
    def in_fix(self) -> str:
        """Whether the fix has it; "?": there is a fix, and it does not say."""
        fix, used = self.craft.snapshot.fix, self.seen("used")
        if math.isnan(used):
            return "?" if self.delivers and fix is not None and fix.mode != "NO_FIX" else "-"
        return "yes" if used else "-"

    @property
    def satellite(self) -> str:
        sat = self.track("sat" if self.delivers else "asked")
        return satellites.name(sat) if sat >= 0 else "-"

    @property
    def style(self) -> str:
        return "" if self.state == _FULL else "warn" if self.satellite != "-" else "dim"


def number(value: float, decimals: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{decimals}f}"


def age(seconds: float) -> str:
    """'7s', '12m04', '3h07', '2d05'."""
    whole = int(seconds)
    if whole < 60:
        return f"{whole}s"
    for unit, letter, next_unit in ((86400, "d", 3600), (3600, "h", 60), (60, "m", 1)):
        if whole >= unit:
            return f"{whole // unit}{letter}{whole % unit // next_unit:02d}"
    raise AssertionError(seconds)


@dataclass(frozen=True, slots=True)
class Column:
    head: str
    width: int
    text: Callable[[Cell], str]
    unit: str = ""


COLUMNS = {
    column.head: column
    for column in (
        Column("ch", 2, lambda cell: str(cell.channel)),
        Column("sat", 4, lambda cell: cell.satellite),
        Column("state", 8, lambda cell: cell.state),
        Column("C/N0", 5, lambda cell: number(cell.seen("cn0_dbhz"), 1), "dBHz"),
        Column("off", 5, lambda cell: number(math.degrees(cell.seen("off_rad")), 1), "deg"),
        Column("age", 5, lambda cell: age(cell.age_s) if cell.delivers else "-"),
        Column("fix", 3, lambda cell: cell.in_fix),
    )
}
SETS = (
    ("ch", "sat", "state", "C/N0", "off", "age", "fix"),
    ("ch", "sat", "C/N0", "off", "age"),
    ("sat", "C/N0", "off"),
    ("sat", "C/N0"),
    ("sat",),
)
"""Columns of the channel tables, from the most to the fewest."""

_LEFT = ("sat", "state")


def _row(texts: Iterator[tuple[str, str]]) -> str:
    return " ".join(
        text[: COLUMNS[head].width].ljust(COLUMNS[head].width)
        if head in _LEFT
        else text[: COLUMNS[head].width].rjust(COLUMNS[head].width)
        for head, text in texts
    )


@dataclass(frozen=True, slots=True)
class Grid:
    """How the antennas' tables are laid out: columns, blocks side by side, channels shown of each."""

    columns: tuple[str, ...]
    side_by_side: int
    channels: int

    @property
    def width(self) -> int:
        return sum(COLUMNS[head].width + 1 for head in self.columns) - 1


def arranged(antennas: int, channels: int, width: int, height: int) -> Grid:
    """The arrangement that shows most channels, and of those the one with most columns."""

    def fit(columns: tuple[str, ...]) -> Grid:
        block = Grid(columns, 1, 0).width
        beside_each_other = max(1, min(antennas, (width + len(GAP)) // (block + len(GAP))))
        rows = -(-antennas // beside_each_other)
        return Grid(columns, beside_each_other, max(0, min(channels, height // rows - 2)))

    return max(map(fit, SETS), key=lambda grid: (grid.channels, len(grid.columns)))


def _block(craft: CraftSummary, antenna: int, grid: Grid, most: int, units: bool) -> list[Line]:
    """One antenna's table, its title first; `most` channels that any antenna of the craft has; units stand
    below the heads if asked for."""
    channels = int(craft.vehicle.channels[antenna])
    delivering = int((craft.bus.tracks.sat[antenna, :channels] >= 0).sum())
    title = parted(
        (
            Span(craft.vehicle.names[antenna], "head"), Span(f"{delivering}/{channels}", "head"),
            craft.snapshot.states[antenna], f"RX{antenna + 1}",
        ),
        grid.width,
    )  # fmt: skip
    heads = [line(Span(_row((head, head) for head in grid.columns), "dim"))]
    if units:
        heads.append(line(Span(_row((head, COLUMNS[head].unit) for head in grid.columns), "dim")))
    shown = channels if grid.channels >= most else min(channels, max(grid.channels - 1, 0))
    cells = [Cell(craft, antenna, channel) for channel in range(shown)]
    rows = [line(Span(_row((h, COLUMNS[h].text(c)) for h in grid.columns), c.style)) for c in cells]
    count = f"+{channels - shown}"
    hidden = line(Span(f"{count} more" if len(count) + 5 <= grid.width else count, "dim"))
    return [title, *heads, *rows, *([hidden] if shown < channels else [])]


def _tables(craft: CraftSummary, width: int, height: int) -> list[Line]:
    antennas, most = craft.vehicle.antennas, int(craft.vehicle.channels.max())
    grid = arranged(antennas, most, width, height)
    rows = -(-antennas // grid.side_by_side)
    units = grid.channels >= most and height >= rows * (most + 4)
    blocks = [_block(craft, antenna, grid, most, units) for antenna in range(antennas)]
    groups = [
        beside(blocks[i : i + grid.side_by_side], grid.width) for i in range(0, antennas, grid.side_by_side)
    ]
    spare = height - sum(map(len, groups))
    lines = []
    for i, group in enumerate(groups):
        lines += [line("")] if i and spare >= len(groups) - 1 else []
        lines += group
    return [fitted(spans, width) for spans in lines[:height]]


def _pace(pace: float | None) -> str:
    return "" if pace is None else f"{pace:.{0 if pace >= 10 else 1}f}x real time"


def _title(run: RunSummary, width: int) -> Line:
    parts = [
        f" {run.scenario}",
        f"{clock(run.simulated_s)} of {clock(run.duration_s)}",
        f"{100 * run.simulated_s / run.duration_s:.0f} %",
        _pace(run.pace),
        f"epoch {run.epoch}",
        f"unanswered {run.unanswered}",
    ]
    return line(Span(plain(parted(filter(None, parts), width)), "title"))


def _when(t_ns: int | None) -> list[str]:
    if t_ns is None:
        return ["GPS time unknown"]
    week, second, _ = gpstime.week_second_ns(t_ns)
    return [f"GPS {gpstime.iso(t_ns)[:23]}", f"week {week} s {second}"]


def _fix_parts(craft: CraftSummary) -> list[str | Span]:
    fix = craft.snapshot.fix
    if fix is None:
        return [Span("no answer", "warn")]
    if fix.mode == "NO_FIX":
        return [Span("no fix", "warn"), fix.no_fix]
    error = "-" if craft.error_m is None else f"{craft.error_m:.2f} m"
    pdop = f"{fix.pdop:.2f}" if fix.pdop else "-"
    return [f"error {error}", f"PDOP {pdop}", f"in fix {fix.satellites or '-'}", fix.mode]


def _fault_parts(craft: CraftSummary) -> list[str | Span]:
    counters = craft.bus.counters
    rejected = sum(counters.reasons.values())
    reasons = ", ".join(f"{reason} {count}" for reason, count in counters.reasons.items())
    return [
        Span(f"lost {counters.lost}", "bad" if counters.lost else ""),
        Span(f"rejected {rejected}" + (f": {reasons}" if reasons else ""), "bad" if rejected else ""),
    ]


def _armed_parts(faults: FaultsSummary) -> list[str | Span]:
    """Faults that act now, by name; those that are over and those that are still armed."""
    parts: list[str | Span] = []
    for word, names, style in (
        ("acting", faults.acting, "bad"),
        ("over", faults.over, ""),
        ("armed", faults.armed, "dim"),
    ):
        if names:
            parts.append(Span(f"{word}: {', '.join(names)}", style))
    return parts


def _head(run: RunSummary, craft: CraftSummary, width: int) -> list[Line]:
    load = f"load {craft.bus.load_percent:.2f} %, at most {craft.bus.load_most_percent:.2f} %"
    rows = [
        (craft.name, _when(craft.snapshot.t_ns)),
        ("fix", [f"tracked {craft.tracked}", *_fix_parts(craft)]),
        ("bus", [*_fault_parts(craft), load, f"frames {craft.bus.counters.received}"]),
    ]
    if run.faults is not None:
        rows.append(("faults", _armed_parts(run.faults)))
    label = max(len(name) for name, _ in rows)
    return [
        _title(run, width),
        *(parted((Span(name.ljust(label), "head"), *parts), width) for name, parts in rows),
    ]


def _others(run: RunSummary, width: int, room: int) -> list[Line]:
    """One line for each craft but the first."""
    lines = [
        parted((Span(craft.name, "head"), *_fix_parts(craft), *_fault_parts(craft)), width)
        for craft in run.craft[1:]
    ]
    if len(lines) > room:
        hidden = len(lines) - max(room - 1, 0)
        lines = [*lines[: max(room - 1, 0)], line(Span(f"+{hidden} more craft", "dim"))]
    return lines[:room]


def screen(run: RunSummary, width: int, height: int) -> list[Line]:
    """At most `height` lines of at most `width` characters."""
    head = _head(run, run.craft[0], width)[:height]
    notes = [line(Span(piece, "warn")) for note in run.notes[-2:] for piece in wrapped(note, width)]
    foot = [*_others(run, width, max(1, height // 4)), *notes][: (height - len(head)) // 2]
    room = height - len(head) - len(foot)
    blank = [line("")] if room > 8 else []
    tables = _tables(run.craft[0], width, room - len(blank))
    return [*head, *blank, *tables, *_charts(run.craft[0], width, room - len(blank) - len(tables)), *foot]


_LEAST_CHART, _MOST_CHART = 7, 16
"""Lines of a chart."""
_LEAST_CHART_WIDTH = 36


def _charts(craft: CraftSummary, width: int, room: int) -> list[Line]:
    """Error and satellites over the time so far, below the tables where there is room: side by side, or one
    above the other, or nothing."""
    past = craft.history
    asked = (("error, 3-D", "m", past.error_m), ("satellites in the fix", "", past.satellites))
    together = width >= 2 * _LEAST_CHART_WIDTH + len(GAP)
    each = min(room - 1, _MOST_CHART) if together else min((room - 2) // 2, _MOST_CHART)
    if each < _LEAST_CHART or width < _LEAST_CHART_WIDTH or not past.t_s:
        return []
    wide = (width - len(GAP)) // 2 if together else width
    drawn = [chart(title, unit, past.t_s, values, wide, each) for title, unit, values in asked]
    if together:
        return [line(""), *beside(drawn, wide)]
    return [spans for one in drawn for spans in (line(""), *one)]
