"""Two runs beside each other: their figures with ratios, their errors in one plot."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import SUMMARY
from gnss_hil.tools.report.decimate import extremes
from gnss_hil.tools.report.document import Page, card, table
from gnss_hil.tools.report.figure import Plot, axis, layout, line, numbers
from gnss_hil.tools.report.time_series import NO_FIX, NO_TRUTH
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.summary import metrics
from gnss_hil.tools.results.text import figure, small

_COLOURS = ("--antenna-1", "--antenna-2")
_PERCENT = np.linspace(0, 100, 401)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """One craft's fixes in time, (n,): minutes since the run's first; error_m is None without truth."""

    minutes: NDArray[np.float64]
    satellites: NDArray[np.float64]
    pdop: NDArray[np.float64]
    error_m: NDArray[np.float64] | None


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


def _table(path: Path, craft: str, names: Sequence[str]) -> dict[str, NDArray]:
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

    def of_fixes(values) -> NDArray[np.float64]:
        return np.where(valid, values.astype(float), np.nan)

    error = None
    if truth.exists():
        known = _table(truth, craft, ("t_gps_s", *_AXES))
        at = np.searchsorted(known["t_gps_s"], t_s).clip(max=max(len(known["t_gps_s"]) - 1, 0))
        there = known["t_gps_s"][at] == t_s if len(known["t_gps_s"]) else np.zeros(len(t_s), bool)
        apart = [np.where(there, columns[name] - known[name][at], np.nan) for name in _AXES]
        error = of_fixes(np.linalg.norm(apart, axis=0))
    return Course((t_s - t_s[0]) / 60, of_fixes(columns["satellites_used"]), of_fixes(columns["pdop"]), error)


def rows(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """Figures of two summaries by name: first, second, and the second as a multiple of the first."""
    left, right = _figures(first), _figures(second)
    names = [*left, *(name for name in right if name not in left)]
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
    ratio = f"{b / a:.3g}" if a and b is not None else "-"
    return _shown(a), _shown(b), ratio


def _shown(value: float | int | None) -> str:
    return figure(value) if value is None or isinstance(value, int) else small(value)


def render(names: Sequence[str], body: Sequence[tuple[str, str, str, str]]) -> str:
    """The figures as aligned lines."""
    lines = [("", *names, "ratio"), *body]
    widths = [max(len(cell) for cell in column) for column in zip(*lines, strict=True)]
    return "\n".join(
        f"{line[0]:<{widths[0]}}" + "".join(f"  {c:>{w}}" for c, w in zip(line[1:], widths[1:], strict=True))
        for line in lines
    )


def write(first: Run, second: Run, path: Path) -> Path:
    """The page of a comparison; its path."""
    names = _names(first, second)
    page = Page(f"{names[0]} and {names[1]}")
    page.add(f"<h1>{escape(names[0])} and {escape(names[1])}</h1>")
    for name, run in zip(names, (first, second), strict=True):
        s = run.summary
        said = ", ".join(f"{key} {s.get(key)}" for key in ("scenario", "policy", "seed", "epochs"))
        said = f"{name}: {said}."
        page.add(f'<p class="lead">{escape(said)}</p>')
    for craft in first.courses:
        if craft in second.courses:
            page.add(f"<h2>Craft {escape(craft)}</h2>")
            page.add_plots(_plots(names, (first.courses[craft], second.courses[craft])), craft)
    page.add("<h2>Figures</h2>")
    page.add(card("Side by side", table(["", *names, "ratio"], rows(first.summary, second.summary))))
    page.write(path)
    return path


def _names(first: Run, second: Run) -> tuple[str, str]:
    return (first.name, second.name) if first.name != second.name else ("first", "second")


def _plots(names: Sequence[str], pair: Sequence[Course]) -> list[Plot]:
    errors = [course.error_m for course in pair]
    return [
        _distribution(names, errors),
        _over_time("Position error, 3-D", "Distance of the fix from truth.", "error [m]", names, pair, errors,
                   type="log"),
        _over_time("Satellites", "Distinct satellites in the fix.", "satellites", names, pair,
                   [course.satellites for course in pair], rangemode="tozero"),
        _over_time("Dilution of precision", "Over all measurements of the fix, as the flight software says.",
                   "PDOP", names, pair, [course.pdop for course in pair], type="log", dtick="D2"),
    ]  # fmt: skip


def _over_time(title: str, note: str, label: str, names, pair, values, **style) -> Plot:
    traces = []
    for name, course, column, colour in zip(names, pair, values, _COLOURS, strict=True):
        if column is not None:
            at = extremes(column)
            x, y = numbers(course.minutes[at]), numbers(column[at])
            traces.append(line(name, x, y, colour, line={"width": 1}))
    if not traces:
        return Plot.missing(title, NO_TRUTH)
    axes = layout(axis("time since the run's first epoch [min]"), axis(label, **style))
    return Plot(title, f"{note} A gap is an epoch without a fix.", {"data": traces, "layout": axes})


def _distribution(names, errors) -> Plot:
    title = "Position error, 3-D: how often"
    kept = [None if e is None else e[~np.isnan(e)] for e in errors]
    traces = [
        line(name, numbers(np.percentile(e, _PERCENT)), numbers(_PERCENT), colour)
        for name, e, colour in zip(names, kept, _COLOURS, strict=True)
        if e is not None and len(e)
    ]
    if not traces:
        return Plot.missing(title, NO_TRUTH if any(e is None for e in errors) else NO_FIX)
    axes = layout(axis("error [m]", type="log"), axis("fixes with a smaller error [%]", range=[0, 100]))
    note = "Over all fixes of each run; epochs without a fix do not count."
    return Plot(title, note, {"data": traces, "layout": axes})
