"""Two runs beside each other: what they were set to differently, and their figures with ratios."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gnss_hil.tools.report.comparison.judgement import (
    CONVERGED,
    another_length,
    is_of,
    judged,
    not_judged,
    same_length,
)
from gnss_hil.tools.report.comparison.runs import RUN_KEYS, Run, names_of
from gnss_hil.tools.report.summary_tables import setting, shown
from gnss_hil.tools.results.figures import aligned
from gnss_hil.tools.results.summary import metrics


def differences(first: Run, second: Run) -> list[tuple[str, str, str]]:
    """What the runs were set to differently: key, first, second. A craft's policy is said once."""
    left, right = first.settings, second.settings
    if len(left) == len(RUN_KEYS) or len(right) == len(RUN_KEYS):  # one did not note more
        left, right = ({key: s[key] for key in RUN_KEYS} for s in (left, right))
    found = [(key, setting(left.get(key)), setting(right.get(key))) for key in dict.fromkeys((*left, *right))]
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


Row = tuple[str, str, str, str, str]
"""A figure of two runs: name, first, second, the second as a multiple of the first, which is better."""

_TIMES = ("real_time_factor", "epoch_latency_ms", "mark_late_ms", "bus_load_percent")


def sections(first: Run, second: Run) -> list[tuple[str, list[Row]]]:
    """Figures by what they are of: each craft after convergence, each whole run, the record, the bench."""
    left, right = _figures(first.summary), _figures(second.summary)
    same, graded = same_length(first.summary, second.summary), not not_judged(first, second)
    parts: dict[str, list[Row]] = {title: [] for title in _titles(first, second)}
    for name in dict.fromkeys((*left, *right)):
        a, b = left.get(name), right.get(name)
        if _says_nothing(name, a, b) or all(_before_convergence(name, figures) for figures in (left, right)):
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


def _says_nothing(name: str, a: float | None, b: float | None) -> bool:
    """Whether neither run has a figure, or both have one that says something only where it is not 0."""
    return (a is None and b is None) or (is_of(name, _SHOWN_IF_ANY) and not a and not b)


def _before_convergence(name: str, figures: Mapping[str, Any]) -> bool:
    """Whether a figure is of the epochs after convergence of a run that ended before."""
    craft, converged, _ = name.partition(f".{CONVERGED}.")
    return bool(converged) and not figures.get(f"{craft}.{CONVERGED}.epochs")


def _titles(first: Run, second: Run) -> Iterator[str]:
    craft = list(dict.fromkeys((*first.summary["craft"], *second.summary["craft"])))
    yield from (f"{name} after convergence" for name in craft)
    yield from (f"{name}, whole run with its cold start" for name in craft)
    yield from (_RECORD, _BENCH)


def _title_of(name: str, titles: Mapping[str, Any]) -> str:
    """The section of a figure."""
    if is_of(name, _TIMES):
        return _BENCH
    craft, _, figure = name.partition(".")
    settled = f"{craft} after convergence"
    if settled not in titles:
        return _RECORD
    return settled if figure.startswith(f"{CONVERGED}.") else f"{craft}, whole run with its cold start"


def _figures(summary: Mapping[str, Any]) -> dict[str, float | int | None]:
    flat = metrics({k: v for k, v in summary.items() if k not in _NO_FIGURES})
    return {
        name.removeprefix("craft."): value
        for name, value in flat.items()
        if value is None or (isinstance(value, int | float) and not isinstance(value, bool))
    }


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
