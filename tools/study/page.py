"""A study of factors as one HTML file: a table, and for each factor its course in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.tools.report.document import Page, card, lead, note
from gnss_hil.tools.report.markup import table, tag
from gnss_hil.tools.report.plot import Plot, axis, log_axis, overlaid, positive_span
from gnss_hil.tools.results.figures import aligned
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


def text(rows: Sequence[Mapping[str, Any]]) -> str:
    """The figures as aligned lines."""
    return aligned([("factor", *COLUMNS), *map(cells, rows)])


def write(effects: Sequence[Effect], rows: Sequence[Mapping[str, Any]], about: str, path: Path) -> None:
    """The page of a study."""
    page = Page("Error factors, one at a time")
    titles = ("factor", *(title for title, _ in COLUMNS.values()))
    page.add(
        tag.h1(page.title),
        lead(about),
        card("Figures", note(_NOTE), table(titles, map(cells, rows)), style="card wide"),
        tag.h2("In time"),
    )
    page.add_plots(map(_course, effects))
    page.write(path)


def _course(effect: Effect) -> Plot:
    """Length of the first craft's error and of the difference, over time."""
    errors = effect.level
    parts = (("fix, first craft", errors.position_m[0]), ("difference", errors.difference_m))
    # A logarithmic axis has no zero: what the bus cannot resolve is drawn at its step.
    curves = [
        (name, errors.t_s, np.maximum(np.linalg.norm(vectors, axis=1), 1e-4)) for name, vectors in parts
    ]
    x, y = (
        axis("time since the start [s]"),
        log_axis("error, 3-D [m]", *positive_span(*(c for *_, c in curves))),
    )
    return overlaid(effect.factor, "Error of the fix, and of the relative position.", x, y, curves)
