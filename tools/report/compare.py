"""Two runs beside each other: their figures with ratios, their errors in one plot.

Better or worse are only figures of the same flight: the same craft on the same orbit under the same sky, with
the same draws. What the bench itself took, its times, is a matter of the machine and never judged."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import SCENARIO, SUMMARY
from gnss_hil.tools.report.document import Page, card, lead
from gnss_hil.tools.report.markup import Child, table, tag
from gnss_hil.tools.report.plot import Json, Plot, axis, log_axis, overlaid, positive_span
from gnss_hil.tools.report.summary_tables import setting, shown
from gnss_hil.tools.report.time_series import NO_FIX, NO_TRUTH
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.assemble import read_facts
from gnss_hil.tools.results.summary import metrics, satellites_in_fix, stated
from gnss_hil.tools.results.text import aligned

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
    """A run folder: its name, its summary, a course for each craft, what it has other than the defaults
    (`provenance.settings`), with the sides that are not ours and its pace, and which flight it is of
    (`_flight_of`)."""

    name: str
    summary: Mapping[str, Any]
    courses: Mapping[str, Course]
    settings: Mapping[str, Any]
    flight: Mapping[str, Any]


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
    courses = {craft: course for craft in crafts if (course := _course(folder, craft))}
    return Run(name, summary, courses, _settings(folder, summary), _flight_of(folder, summary))


_OF_THE_CRAFT = ("orbit", "trajectory", "observations", "attitude", "structure")


def _flight_of(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    """What makes a flight one that another may be judged by: what flew, where, when, under which sky and with
    which draws. What a flight software, its receivers and the errors on them are is what one judges."""
    path = folder / SCENARIO
    document = tomllib.loads(path.read_text("utf-8")) if path.is_file() else {}
    craft = {one["name"]: one for one in document.get("craft", ())}
    of_craft = {f"{key} of {name}": one.get(key) for name, one in craft.items() for key in _OF_THE_CRAFT}
    sky = {key: value for key, value in document.get("sky", {}).items() if key != "factors"}
    return {
        "craft": ", ".join(summary["craft"]),
        "emulator": summary.get("emulator"),
        "start": document.get("time", {}).get("start_gps"),
        "sky": sky,
        **of_craft,
        "seed": summary.get("seed"),
    }


def not_judged(first: Run, second: Run) -> str:
    """Why neither run can be better than the other, in a line; "" if one can."""
    if first.flight["craft"] != second.flight["craft"]:
        keys = ["craft"]
    else:
        keys = [key for key, value in first.flight.items() if value != second.flight.get(key)]
    if not keys:
        return ""
    said = ", ".join(key + _in_words(first.flight.get(key), second.flight.get(key)) for key in keys)
    return f"Nothing is judged better or worse: the runs are not of the same flight; they differ in {said}."


def _in_words(a: Any, b: Any) -> str:
    """What two runs have, if that is a word or two."""
    return f" ({a} / {b})" if isinstance(a, str | int) and isinstance(b, str | int) else ""


def another_length(first: Run, second: Run) -> str:
    """Why figures of the whole runs are not judged, in a line; "" if they are."""
    if _same_length(first.summary, second.summary):
        return ""
    return (
        "The runs are not of the same length: judged are figures after convergence alone, since the first "
        "minute is another share of each run."
    )


def _same_length(first: Mapping[str, Any], second: Mapping[str, Any]) -> bool:
    return all(first.get(key) == second.get(key) for key in ("epochs", "epoch_interval_s"))


_RUN_KEYS = ("scenario", "policy", "seed", "duration_s", "epoch_interval_s", "pace", "emulator")
_SAID_BY_THE_RUN = ("seed", "time.duration_s", "time.epoch_interval_s")


def _settings(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    about = (read_facts(folder) or {}).get("about", {})
    own = {key: value for key, value in about.get("settings", {}).items() if key not in _SAID_BY_THE_RUN}
    return {key: summary.get(key) for key in _RUN_KEYS} | own


def differences(first: Run, second: Run) -> list[tuple[str, str, str]]:
    """What the runs were set to differently: key, first, second. A craft's policy is said once."""
    left, right = first.settings, second.settings
    if len(left) == len(_RUN_KEYS) or len(right) == len(_RUN_KEYS):  # one did not note more
        left, right = ({key: s[key] for key in _RUN_KEYS} for s in (left, right))
    keys = [*left, *(key for key in right if key not in left)]
    found = [(key, setting(left.get(key)), setting(right.get(key))) for key in keys]
    found = [row for row in found if row[1] != row[2]]
    policy = [row for row in found if row[0] == "policy"]
    return [row for row in found if not (policy and row[0].endswith(".flight.policy"))]


_IN_A_TITLE = 3


def title(first: Run, second: Run) -> str:
    """What differs, as a headline."""
    rows = differences(first, second)
    if not rows:
        return f"{first.name} and {second.name}"
    said = [f"{key.removeprefix('craft.0.')} {a} / {b}" for key, a, b in rows[:_IN_A_TITLE]]
    more = f"; {len(rows) - _IN_A_TITLE} more" if len(rows) > _IN_A_TITLE else ""
    return f"{'; '.join(said)}{more}"


_LESS_IS_BETTER = (
    "epochs_unanswered", "frames.lost", "frames.rejected", "no_fix", "first_fix_s", "outages", "pdop",
    "pdop_distinct", "position_error_m", "velocity_error_mps", "rejected",
)  # fmt: skip
_MORE_IS_BETTER = ("fixes", "satellites_tracked")
_ALIKE = 0.005
"""Share by which figures may differ and count as equal."""

_COUNTS = ("fixes", "no_fix", "outages", "frames", "rejected", "epochs_unanswered")
"""Figures that grow with a run; so do the greatest and the least of something."""
_CONVERGED = "converged"


def _is_of(name: str, keys: Sequence[str]) -> bool:
    """Whether a dotted name has one of the keys."""
    return any(f".{key}." in f".{name}." for key in keys)


def judged(name: str, a: float | None, b: float | None, same_length: bool = True) -> str:
    """Whether the second run's figure is "better" or "worse" than the first's; "" where they are alike, one
    is missing, or neither more nor less of it is better. Of runs of another length only figures after
    convergence are compared that do not grow with a run."""
    if a is None or b is None or abs(b - a) <= _ALIKE * max(abs(a), abs(b)):
        return ""
    grows = _is_of(name, _COUNTS) or name.endswith((".max", ".min"))
    if not same_length and (grows or not _is_of(name, (_CONVERGED,))):
        return ""
    if _is_of(name, _LESS_IS_BETTER):
        return "better" if b < a else "worse"
    if _is_of(name, _MORE_IS_BETTER):
        return "better" if b > a else "worse"
    return ""


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
    columns = _table(fixes, craft, ("t_gps_s", "valid", "satellites_used", "satellites", "pdop", *_AXES))
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
    satellites = satellites_in_fix(columns["satellites_used"], columns["satellites"])
    return Course((t_s - t_s[0]) / 60, of_fixes(satellites), of_fixes(stated(columns["pdop"])), error)


Row = tuple[str, str, str, str, str]
"""A figure of two runs: name, first, second, the second as a multiple of the first, which is better."""

_TIMES = ("real_time_factor", "epoch_latency_ms", "mark_late_ms", "bus_load_percent")


def sections(first: Run, second: Run) -> list[tuple[str, list[Row]]]:
    """Figures by what they are of: each craft after convergence, each whole run, the record, the bench."""
    left, right = _figures(first.summary), _figures(second.summary)
    names = [*left, *(name for name in right if name not in left)]
    names = [name for name in names if not _is_of(name, _SHOWN_IF_ANY) or left.get(name) or right.get(name)]
    names = [
        name for name in names if not _before_convergence(name, left) or not _before_convergence(name, right)
    ]
    same, graded = _same_length(first.summary, second.summary), not not_judged(first, second)
    parts: dict[str, list[Row]] = {title: [] for title in _titles(first, second)}
    for name in names:
        a, b = left.get(name), right.get(name)
        if a is None and b is None:
            continue
        ratio = f"{b / a:.3g}" if a and b is not None else "-"
        verdict = judged(name, a, b, same) if graded else ""
        parts[_title_of(name, parts)].append((name, shown(a), shown(b), ratio, verdict))
    return [(title, rows) for title, rows in parts.items() if rows]


_NO_FIGURES = ("expectations", "seed", "epoch_interval_s", "epochs_planned")
_SHOWN_IF_ANY = ("no_fix", "fixes_without", "satellites_paired")
"""Figures that say nothing where they are 0 in both runs."""
_RECORD, _BENCH = (
    "The run and its record",
    "What the bench took: its times and the load of the bus, not judged",
)


def _before_convergence(name: str, figures: Mapping[str, Any]) -> bool:
    """Whether a figure is of the epochs after convergence of a run that ended before."""
    craft, converged, _ = name.partition(f".{_CONVERGED}.")
    return bool(converged) and not figures.get(f"{craft}.{_CONVERGED}.epochs")


def _titles(first: Run, second: Run) -> Iterator[str]:
    craft = list(dict.fromkeys((*first.summary["craft"], *second.summary["craft"])))
    yield from (f"{name} after convergence" for name in craft)
    yield from (f"{name}, whole run with its cold start" for name in craft)
    yield from (_RECORD, _BENCH)


def _title_of(name: str, titles: Mapping[str, Any]) -> str:
    """The section of a figure."""
    if _is_of(name, _TIMES):
        return _BENCH
    craft, _, figure = name.partition(".")
    settled = f"{craft} after convergence"
    if settled not in titles:
        return _RECORD
    return settled if figure.startswith(f"{_CONVERGED}.") else f"{craft}, whole run with its cold start"


def _within_section(name: str, crafts: Collection[str]) -> str:
    """What a craft's figure is called below a title that says whose it is."""
    craft, _, figure = name.partition(".")
    return figure.removeprefix(f"{_CONVERGED}.") if craft in crafts else name


def _figures(summary: Mapping[str, Any]) -> dict[str, float | int | None]:
    flat = metrics({k: v for k, v in summary.items() if k not in _NO_FIGURES})
    return {
        name.removeprefix("craft."): value
        for name, value in flat.items()
        if value is None or (isinstance(value, int | float) and not isinstance(value, bool))
    }


def names_of(first: Run, second: Run) -> tuple[str, str]:
    """What the runs are called beside each other."""
    return (first.name, second.name) if first.name != second.name else ("first", "second")


def heads(first: Run, second: Run) -> tuple[str, ...]:
    """Heads of the columns of `sections`; without the last where nothing is judged."""
    names = names_of(first, second)
    return ("", *names, "ratio", *(() if not_judged(first, second) else (f"{names[1]} is",)))


def told(first: Run, second: Run) -> list[str]:
    """The comparison in lines of text."""
    columns = heads(first, second)
    lines = [
        title(first, second),
        *filter(None, (not_judged(first, second) or another_length(first, second),)),
    ]
    table_rows: list[Sequence[str]] = []
    for name, rows in sections(first, second):
        table_rows += [[""] * len(columns), [name, *columns[1:]], *(row[: len(columns)] for row in rows)]
    return [*lines, *_in_columns(table_rows)]


def _in_columns(table_rows: Sequence[Sequence[str]]) -> list[str]:
    return [line.rstrip() for line in aligned(table_rows).splitlines()]


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
