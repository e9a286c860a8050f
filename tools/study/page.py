"""A study of factors as one HTML file: a table, and for each factor its course in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.tools.report.decimate import extremes
from gnss_hil.tools.report.document import Page, card, table
from gnss_hil.tools.report.figure import Plot, axis, layout, line, numbers
from gnss_hil.tools.study.factors import COLUMNS, Effect

_NOTE = (
    "Every run differs from the first only by its factor. Errors are those of fixes against the truth; the "
    "difference is the error of the first craft's position relative to the second's. 'Same satellites': both "
    "fixes are of the same satellites on the same antennas. 'Other satellites': the second craft is turned."
)


def small(value: float) -> str:
    """A figure with three digits."""
    return "-" if not np.isfinite(value) else f"{value:.3g}"


def cells(row: Mapping[str, Any]) -> list[str]:
    return [row["factor"], *(small(row[name]) for name in COLUMNS)]


def heads() -> list[str]:
    return ["factor", *(title for title, _ in COLUMNS.values())]


def text(rows: Sequence[Mapping[str, Any]]) -> str:
    """The figures as aligned lines."""
    short = ["factor", *COLUMNS]
    body = [short, *(cells(row) for row in rows)]
    widths = [max(map(len, column)) for column in zip(*body, strict=True)]
    lines = ("".join(f"  {c:>{w}}" for c, w in zip(line[1:], widths[1:], strict=True)) for line in body)
    return "\n".join(f"{row[0]:<{widths[0]}}{line}" for row, line in zip(body, lines, strict=True))


def write(effects: Sequence[Effect], rows: Sequence[Mapping[str, Any]], about: str, path: Path) -> None:
    """The page of a study."""
    page = Page("Error factors, one at a time")
    page.add("<h1>Error factors, one at a time</h1>")
    page.add(f'<p class="lead">{escape(about)}</p>')
    page.add(
        card("Figures", f'<p class="note">{escape(_NOTE)}</p>' + table(heads(), map(cells, rows)), "wide")
    )
    page.add("<h2>In time</h2>")
    page.add_plots([_course(effect) for effect in effects])
    page.write(path)


def _course(effect: Effect) -> Plot:
    """Length of the first craft's error and of the difference, over time."""
    errors = effect.level
    traces = []
    parts = (
        ("fix, first craft", errors.position_m[0], "--antenna-1"),
        ("difference", errors.difference_m, "--antenna-2"),
    )
    for name, vectors, colour in parts:
        length = np.linalg.norm(vectors, axis=1)
        at = extremes(length)
        # A logarithmic axis has no zero: what the bus cannot resolve is drawn at its step.
        shown = np.maximum(length[at], 1e-4)
        traces.append(line(name, numbers(errors.t_s[at]), numbers(shown), colour, line={"width": 1}))
    axes = layout(
        axis("time since the start [s]"), axis("error, 3-D [m]", type="log", exponentformat="power")
    )
    return Plot(
        effect.factor, "Error of the fix, and of the relative position.", {"data": traces, "layout": axes}
    )
