"""Small charts of characters: a value over the time that a run has come so far."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.live.screen import Line, Span, fitted, line

_EIGHTHS = " ▁▂▃▄▅▆▇█"
_ROUND = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
_LABEL = 7
"""Characters of the scale, its blank included."""
_MOST = 4096


@dataclass(slots=True)
class History:
    """Samples of a run so far: when [s], 3-D error [m], satellites in the fix; nan where there is none.

    When there are too many, every second one goes: the oldest are as fine as the latest.
    """

    t_s: list[float] = field(default_factory=list)
    error_m: list[float] = field(default_factory=list)
    satellites: list[float] = field(default_factory=list)

    def add(self, t_s: float, error_m: float | None, satellites: float | None) -> None:
        if len(self.t_s) >= _MOST:
            for column in (self.t_s, self.error_m, self.satellites):
                del column[1::2]
        self.t_s.append(t_s)
        self.error_m.append(math.nan if error_m is None else error_m)
        self.satellites.append(math.nan if satellites is None else satellites)


def chart(
    title: str, unit: str, t_s: Sequence[float], values: Sequence[float], width: int, height: int
) -> list[Line]:
    """`height` lines of `width` characters: a title with the unit, bars from zero up, and the time below.

    The scale ends at a round number above all values or, where some are wild, above three times the middle
    one; bars that are higher are cut and of another colour. A column without a value is a dot.
    """
    columns, rows = width - _LABEL, height - 2
    bars = _means(t_s, values, columns)
    known = sorted(v for v in values if math.isfinite(v))
    latest = next((v for v in reversed(values) if math.isfinite(v)), math.nan)
    head = line(Span(title, "head"), f" [{unit}]" if unit else "", f"  now {_short(latest)}")
    if not known:
        return [fitted(part, width) for part in (head, line(Span("nothing yet", "dim")))]
    top = round_up(min(known[-1], 3 * known[len(known) // 2]))
    scale = {0: _short(top), rows - 1: "0"}
    if rows >= 5:
        scale[rows // 2] = _short(top * (rows - rows // 2) / rows)
    lines = [fitted(head, width)]
    for row in range(rows):
        label = Span(scale.get(row, "").rjust(_LABEL - 1) + " ", "dim")
        lines.append(fitted((label, *_row(bars, top, rows - 1 - row, rows)), width))
    end = clock(max(t_s))
    lines.append(fitted((Span(" " * _LABEL), Span("0:00" + end.rjust(max(columns - 4, 0)), "dim")), width))
    return lines


def round_up(value: float) -> float:
    """The next round number."""
    if not value > 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{m * decade:.6g}") for m in _ROUND if m * decade >= value * (1 - 1e-9))


def _short(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3g}"


def _means(t_s: Sequence[float], values: Sequence[float], columns: int) -> list[float]:
    """The mean of each column of time; nan where there is no value, the value before where there is no
    sample."""
    total, count, seen = [0.0] * columns, [0] * columns, [False] * columns
    span = max(t_s) or 1.0
    for t, value in zip(t_s, values, strict=True):
        k = min(int(t / span * columns), columns - 1)
        seen[k] = True
        if math.isfinite(value):
            total[k] += value
            count[k] += 1
    means: list[float] = []
    for k in range(columns):
        empty = means[-1] if means and not seen[k] else math.nan
        means.append(total[k] / count[k] if count[k] else empty)
    return means


def _row(bars: Sequence[float], top: float, row: int, rows: int) -> list[Span]:
    """One line of bars, `row` counted from below, in runs of one style."""
    spans: list[Span] = []
    for value in bars:
        if math.isnan(value):
            character, style = ("·" if row == 0 else " "), "dim"
        else:
            filled = min(max(value / top * rows - row, 0.0), 1.0)
            character = _EIGHTHS[max(round(8 * filled), int(row == 0))]
            style = "warn" if value > top else ""
        if spans and spans[-1].style == style:
            spans[-1] = Span(spans[-1].text + character, style)
        else:
            spans.append(Span(character, style))
    return spans
