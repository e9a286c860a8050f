"""The page of two runs: their figures beside each other, their errors in one plot."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.report.comparison.figures import Row, differences, heads, sections, title
from gnss_hil.tools.report.comparison.judgement import CONVERGED, another_length, not_judged
from gnss_hil.tools.report.comparison.runs import Course, Run, names_of
from gnss_hil.tools.report.document import Page, card, lead
from gnss_hil.tools.report.markup import Child, table, tag
from gnss_hil.tools.report.plot import Json, Plot, axis, log_axis, overlaid, positive_span
from gnss_hil.tools.report.time_series import NO_FIX, NO_TRUTH

_PERCENT = np.linspace(0, 100, 401)


def _within_section(name: str, crafts: Collection[str]) -> str:
    """What a craft's figure is called below a title that says whose it is."""
    craft, _, figure = name.partition(".")
    return figure.removeprefix(f"{CONVERGED}.") if craft in crafts else name


def _marked(row: Row, columns: int) -> Iterator[Child]:
    """A row's cells, the verdict in its colour."""
    *cells, verdict = row
    yield from cells[:columns]
    if columns > len(cells):
        yield tag.span(verdict, class_={"better": "good", "worse": "bad"}.get(verdict))


def write(first: Run, second: Run, path: Path) -> Path:
    """The page of a comparison; its path."""
    names = names_of(first, second)
    page = Page(title(first, second))
    page.add(tag.h1(page.title))
    for name, run in zip(names, (first, second), strict=True):
        facts = ", ".join(f"{key} {run.summary.get(key)}" for key in ("scenario", "policy", "seed", "epochs"))
        page.add(lead(f"{name}: {facts}."))
    page.add(*(lead(why) for why in (not_judged(first, second) or another_length(first, second),) if why))
    for craft in first.courses:
        if craft in second.courses:
            page.add(tag.h2(f"Craft {craft}"))
            page.add_plots(_plots(names, (first.courses[craft], second.courses[craft])), craft)
    set_apart = differences(first, second)
    if set_apart:
        page.add(card("Set differently", table(("", *names), set_apart, class_="words")))
    columns, crafts = heads(first, second), {*first.summary["craft"], *second.summary["craft"]}
    page.add(tag.h2("Figures"))
    for name, rows in sections(first, second):
        short = [(_within_section(row[0], crafts), *row[1:]) for row in rows]
        page.add(card(name, table(columns, (_marked(row, len(columns)) for row in short))))
    page.write(path)
    return path


def _plots(names: Sequence[str], pair: Sequence[Course]) -> list[Plot]:
    errors = [course.error_m for course in pair]

    def over_time(title: str, note: str, y: Json, values: Sequence[F64 | None]) -> Plot:
        curves = [
            (name, course.minutes, column)
            for name, course, column in zip(names, pair, values, strict=True)
            if column is not None
        ]
        if not curves:
            return Plot.missing(title, NO_TRUTH)
        x = axis("time since the run's first epoch [min]")
        return overlaid(title, f"{note} A gap is an epoch without a fix.", x, y, curves)

    return [
        _distribution(names, errors),
        over_time("Position error, 3-D", "Distance of the fix from truth.",
                  _log_axis("error [m]", errors), errors),
        over_time("Satellites", "Distinct satellites in the fix.",
                  axis("satellites", rangemode="tozero"), [course.satellites for course in pair]),
        over_time("Dilution of precision", "Over all measurements of the fix, as published.",
                  _log_axis("PDOP", [course.pdop for course in pair]), [course.pdop for course in pair]),
    ]  # fmt: skip


def _log_axis(title: str, values: Sequence[F64 | None]) -> Json:
    return log_axis(title, *positive_span(*(v for v in values if v is not None)))


def _distribution(names: Sequence[str], errors: Sequence[F64 | None]) -> Plot:
    title = "Position error, 3-D: how often"
    kept = [(name, e[~np.isnan(e)]) for name, e in zip(names, errors, strict=True) if e is not None]
    curves = [(name, np.percentile(e, _PERCENT), _PERCENT) for name, e in kept if len(e)]
    if not curves:
        return Plot.missing(title, NO_FIX if len(kept) == len(errors) else NO_TRUTH)
    note = "Over all fixes of each run; epochs without a fix do not count."
    y = axis("fixes with a smaller error [%]", range=[0, 100])
    return overlaid(title, note, _log_axis("error [m]", [e for _, e in kept]), y, curves)
