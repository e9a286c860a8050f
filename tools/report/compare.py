"""Two runs beside each other: their figures with ratios, their errors in one plot."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import SUMMARY
from gnss_hil.tools.report.document import Page, card, lead
from gnss_hil.tools.report.markup import table, tag
from gnss_hil.tools.report.plot import Json, Plot, axis, overlaid
from gnss_hil.tools.report.summary_tables import shown
from gnss_hil.tools.report.time_series import NO_FIX, NO_TRUTH
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.summary import metrics

_PERCENT = np.linspace(0, 100, 401)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """One craft's fixes in time, (n,): minutes since the run's first; error_m is None without truth."""

    minutes: F64
    satellites: F64
    pdop: F64
    error_m: F64 | None


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A run folder: its name, its summary, and a course for each craft."""

    name: str
    summary: Mapping[str, Any]
    courses: Mapping[str, Course]


def read(folder: Path) -> Run:
    """What a comparison needs of a run folder; Mistake if it is not there."""
    path = folder / SUMMARY
    if not path.is_file():
        raise Mistake(f"{folder}: has no {SUMMARY}; `gnss-hil report {folder}` makes it of a run with a log")
    try:
        summary = json.loads(path.read_bytes())
        crafts = list(summary["craft"])
    except (ValueError, KeyError, TypeError):
        raise Mistake(f"{path}: is damaged; `gnss-hil report {folder}` makes it again") from None
    name = folder.resolve().name
    return Run(name, summary, {craft: course for craft in crafts if (course := _course(folder, craft))})


_AXES = tuple(f"{a}_ecef_m" for a in "xyz")


def _table(path: Path, craft: str, names: Sequence[str]) -> dict[str, Any]:
    """Columns of one craft; Mistake if the table is damaged."""
    try:
        return parquet.of_craft(path, craft, names)
    except parquet.Damaged as error:
        raise Mistake(f"{error}; `gnss-hil report {path.parent}` makes it again") from None


def _course(folder: Path, craft: str) -> Course | None:
    fixes, truth = folder / "fixes.parquet", folder / "truth.parquet"
    if not fixes.exists():
        return None
    columns = _table(fixes, craft, ("t_gps_s", "valid", "satellites_used", "pdop", *_AXES))
    t_s = columns["t_gps_s"]
    if not len(t_s):
        return None
    valid = columns["valid"]

    def of_fixes(values) -> F64:
        return np.where(valid, values.astype(float), np.nan)

    error = None
    if truth.exists():
        true = _table(truth, craft, ("t_gps_s", *_AXES))
        _, at, there = np.intersect1d(t_s, true["t_gps_s"], return_indices=True)
        error = np.full(len(t_s), np.nan)
        error[at] = np.linalg.norm([columns[name][at] - true[name][there] for name in _AXES], axis=0)
        error = of_fixes(error)
    return Course((t_s - t_s[0]) / 60, of_fixes(columns["satellites_used"]), of_fixes(columns["pdop"]), error)


def rows(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """Figures of two summaries by name: first, second, and the second as a multiple of the first."""
    left, right = _figures(first), _figures(second)
    names = [*left, *(name for name in right if name not in left)]
    names = [name for name in names if ".no_fix." not in name or left.get(name) or right.get(name)]
    return [(name, *_row(left.get(name), right.get(name))) for name in names]


def _figures(summary: Mapping[str, Any]) -> dict[str, float | int | None]:
    flat = metrics(
        {k: v for k, v in summary.items() if k not in ("expectations", "seed", "epoch_interval_s")}
    )
    return {
        name.removeprefix("craft."): value
        for name, value in flat.items()
        if value is None or (isinstance(value, int | float) and not isinstance(value, bool))
    }


def _row(a, b) -> tuple[str, str, str]:
    return shown(a), shown(b), f"{b / a:.3g}" if a and b is not None else "-"


def write(first: Run, second: Run, path: Path) -> Path:
    """The page of a comparison; its path."""
    names = (first.name, second.name) if first.name != second.name else ("first", "second")
    page = Page(f"{names[0]} and {names[1]}")
    page.add(tag.h1(page.title))
    for name, run in zip(names, (first, second), strict=True):
        facts = ", ".join(f"{key} {run.summary.get(key)}" for key in ("scenario", "policy", "seed", "epochs"))
        page.add(lead(f"{name}: {facts}."))
    for craft in first.courses:
        if craft in second.courses:
            page.add(tag.h2(f"Craft {craft}"))
            page.add_plots(_plots(names, (first.courses[craft], second.courses[craft])), craft)
    figures = table(("", *names, "ratio"), rows(first.summary, second.summary))
    page.add(tag.h2("Figures"), card("Side by side", figures))
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
                  axis("error [m]", type="log"), errors),
        over_time("Satellites", "Distinct satellites in the fix.",
                  axis("satellites", rangemode="tozero"), [course.satellites for course in pair]),
        over_time("Dilution of precision", "Over all measurements of the fix, as published.",
                  axis("PDOP", type="log", dtick="D2"), [course.pdop for course in pair]),
    ]  # fmt: skip


def _distribution(names: Sequence[str], errors: Sequence[F64 | None]) -> Plot:
    title = "Position error, 3-D: how often"
    kept = [(name, e[~np.isnan(e)]) for name, e in zip(names, errors, strict=True) if e is not None]
    curves = [(name, np.percentile(e, _PERCENT), _PERCENT) for name, e in kept if len(e)]
    if not curves:
        return Plot.missing(title, NO_FIX if len(kept) == len(errors) else NO_TRUTH)
    note = "Over all fixes of each run; epochs without a fix do not count."
    y = axis("fixes with a smaller error [%]", range=[0, 100])
    return overlaid(title, note, axis("error [m]", type="log"), y, curves)
