"""The monitor's table on a terminal, and the totals at its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.frames import ERR_FLAG, FrameBatch
from gnss_hil.tools.live.layout import age
from gnss_hil.tools.live.screen import Line, Span, fitted, line, parted
from gnss_hil.tools.monitor.filter import FrameFilter
from gnss_hil.tools.monitor.format import Formatter, check, identifier, payload
from gnss_hil.tools.monitor.stats import BusStats

_WIDTH = {"id": 3, "message": 16, "sender": 6, "Hz": 7, "frames": 8, "check": 14, "faults": 6, "age": 5}
_LEFT = ("id", "message", "sender", "check")
_COLUMNS = (
    (0, ("id", "message", "Hz", "check")),
    (80, ("id", "message", "Hz", "check", "age")),
    (110, ("id", "message", "Hz", "frames", "check", "faults", "age")),
    (130, ("id", "message", "sender", "Hz", "frames", "check", "faults", "age")),
)
"""Columns by the least width of the window; the values take the rest."""


def chosen(stats: BusStats, wanted: FrameFilter) -> np.ndarray:
    """Rows that were heard and are to be shown."""
    rows = stats.heard
    return rows[wanted.of(stats.can_id[rows])]


def screen(
    stats: BusStats,
    wanted: FrameFilter,
    formatter: Formatter,
    head: Sequence[str],
    raw: bool,
    now_s: float,
    size,
) -> list[Line]:
    """A window of `size` (columns, lines) full; rows that find no room are counted."""
    width, height = size
    rates = stats.rates_hz(now_s)
    rows = chosen(stats, wanted)
    columns = next(names for least, names in reversed(_COLUMNS) if width >= least)
    heading = " ".join(_cell(name, name) for name in columns) + (" bytes" if raw else " values")
    room = max(height - 3, 0)
    shown = rows if len(rows) <= room else rows[: max(room - 1, 0)]
    texts = _contents(stats, formatter, shown, raw)
    lines = [
        _row(stats, formatter, row, columns, rates[row], text, now_s)
        for row, text in zip(shown, texts, strict=True)
    ]
    if len(shown) < len(rows):
        lines.append(line(Span(f"+{len(rows) - len(shown)} more identifiers; --only narrows", "dim")))
    faults = _faults(stats)
    top = [
        fitted(line(Span(" " + "  ".join(head), "title")), width),
        parted((f"frames {stats.frames}", Span(faults or "no faults", "bad" if faults else "")), width),
        line(Span(heading, "dim")),
    ]
    return [fitted(spans, width) for spans in [*top, *lines][:height]]


def _faults(stats: BusStats) -> str:
    return ", ".join(f"{check(verdict)} {count}" for verdict, count in stats.faults().items())


def _cell(column: str, text: str) -> str:
    """As wide as its column; an identifier of eight digits sticks out rather than lose any."""
    width = _WIDTH[column]
    if column in _LEFT:
        return text.ljust(width) if column == "id" else text[:width].ljust(width)
    return text[:width].rjust(width)


def _row(stats, formatter, row, columns, rate_hz, text, now_s) -> Line:
    can_id = int(stats.can_id[row])
    verdict = int(stats.last_verdict[row])
    cells = {
        "id": identifier(can_id),
        "message": name(formatter, can_id),
        "sender": formatter.sender(can_id),
        "Hz": f"{rate_hz:.1f}",
        "frames": str(stats.counts[row].sum()),
        "check": check(verdict),
        "faults": str(stats.counts[row, 1:].sum() or "-"),
        "age": age(max(now_s - stats.last_s[row], 0.0)),
    }
    style = "bad" if verdict > 1 else "warn" if stats.counts[row, 1:].any() else ""
    return line(Span(" ".join(_cell(column, cells[column]) for column in columns), style), " " + text)


def name(formatter: Formatter, can_id: int) -> str:
    return "error frames" if can_id & ERR_FLAG else formatter.name(can_id)


def _contents(stats: BusStats, formatter: Formatter, rows: np.ndarray, raw: bool) -> list[str]:
    """Bytes or values of the last frames."""
    can_id, length, data = stats.can_id[rows], stats.last_length[rows], stats.last_data[rows]
    if raw:
        return [payload(int(i), int(n), d) for i, n, d in zip(can_id, length, data, strict=True)]
    last = FrameBatch(np.zeros(len(rows), np.int64), can_id, length, data)
    return formatter.values(last, stats.last_verdict[rows])


def totals(
    stats: BusStats, wanted: FrameFilter, formatter: Formatter, seconds: float, dropped: int, left_out: int
) -> str:
    """What was heard, one line for each identifier, and what went wrong."""
    rows = chosen(stats, wanted)
    lines = [f"{'id':8} {'message':16} {'sender':6} {'frames':>9} {'faults':>7}"]
    for row in rows:
        can_id = int(stats.can_id[row])
        by_check = {check(v): int(n) for v, n in enumerate(stats.counts[row]) if v and n}
        lines.append(
            f"{identifier(can_id):8} {name(formatter, can_id):16} {formatter.sender(can_id):6} "
            f"{stats.counts[row].sum():9d} {sum(by_check.values()):7d}  "
            + ", ".join(f"{reason} {count}" for reason, count in by_check.items())
        )
    lines.append(f"{so_many(stats.frames, 'frame')} in {seconds:.1f} s; {_faults(stats) or 'no faults'}")
    for count, what in (
        (stats.missing, "frames missing by the counters of their streams"),
        (stats.unlisted, "frames of further identifiers that are not in the contract"),
        (dropped, "frames lost on the way to this monitor"),
        (left_out, "frames not shown, because the reader of the lines was too slow"),
    ):
        lines += [f"{count} {what}"] if count else []
    return "\n".join(text.rstrip() for text in lines)
