"""Faults in a report: the ledger as a table, the chain from frame to fix, their windows in plots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.emulator.config.scenario import Scenario
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.tools.report import fault_chain
from gnss_hil.tools.report.document import card, note
from gnss_hil.tools.report.markup import Markup, table, tag, text
from gnss_hil.tools.report.plot import Json, Plot, milliseconds
from gnss_hil.tools.results import faults
from gnss_hil.tools.results.expectations import spans
from gnss_hil.tools.results.fault_chain import chain
from gnss_hil.tools.results.fault_text import fault_cells, fault_missed

_HEAD = (
    ("", ""), ("fault", "kind, place"), ("acted in", "epochs"), ("seen by", "after epochs"),
    ("of those expected", "after epochs"), ("frames touched", "refused, let through"), ("worst fix",
"epochs with a fix"), ("", ""), )  # fmt: skip
"""Of each column what stands in its first line, and in its second."""
_MOST_SHADES, _MOST_NAMED = 200, 12
"""Windows that are drawn in a plot, and faults whose numbers are."""


@dataclass(frozen=True, slots=True)
class Window:
    """A fault's number in the ledger, from 1, and from when to when it acted, GPS time."""

    number: int
    begin_ns: int
    end_ns: int


def cards(folder: Path, s: Mapping[str, Any]) -> list[Markup]:
    """What became of the faults, and how far they came on each craft; nothing without faults."""
    rows = s.get("faults")
    if not rows:
        return []
    several = len(s["craft"]) > 1
    return [_ledger(rows, several), *_chains(folder, rows, s)]


def _ledger(rows: Sequence[Mapping[str, Any]], several: bool) -> Markup:
    cells = [_row(number, row, several) for number, row in enumerate(rows, 1)]
    acted = any(row["first_epoch"] is not None for row in rows)
    missed = [line for row in rows for line in fault_missed(row)]
    return card(
        "Faults",
        table((_two(*words) for words in _HEAD), cells, class_="ledger"),
        tag.ul((tag.li(line) for line in missed), class_="bad") if missed else None,
        note(
            "Refused by the protection, and worst fix: while the fault lasted and as long behind it."
            + (" Red in plots over time: a fault acts, by its number." if acted else "")
        ),
        style="card wide",
    )


def _row(number: int, row: Mapping[str, Any], several: bool) -> list[Any]:
    """The ledger's cells, two lines each."""
    name, kind, place, acted, by, after, expected, touched, refused, through, error, share, verdict = (
        fault_cells(row, several)
    )
    style = {"met": "good", "MISSED": "bad"}.get(verdict)
    judged = tag.b(verdict, class_=style) if style else ""
    of = _two(name, f"{kind}, {place}")
    if row["first_epoch"] is None:
        return [number, of, acted, *([""] * 4), judged]
    return [
        number,
        of,
        acted,
        _two(by, after),
        _two(*expected.rpartition(" ")[::2]) if " " in expected else expected,
        _two(touched, f"{refused}, {through}"),
        _two(error.replace(" ", "\u00a0"), share),
        judged,
    ]


def _two(first: str, second: str) -> Markup:
    """Two lines of a cell, the second in small."""
    return text((first, tag.small(second)))


def _chains(folder: Path, rows: Sequence[Mapping[str, Any]], s: Mapping[str, Any]) -> list[Markup]:
    """A drawing for each craft on whose bus a fault acted."""
    found = {craft: chain(folder, craft, rows, s["epochs"]) for craft in s["craft"]}
    return [
        card(f"From frame to fix{f', {craft}' if len(found) > 1 else ''}", fault_chain.drawing(stages))
        for craft, stages in found.items()
        if stages
    ]


def windows(folder: Path, scenario: Scenario, craft: str) -> list[Window]:
    """When which fault acted on a craft's bus, in the order of the ledger's rows."""
    armed, stretches = faults.read(folder)
    time, half = scenario.time, scenario.time.interval_ns // 2
    found: list[Window] = []
    number = 0
    for section, bus in enumerate(armed):
        for place, about in enumerate(bus["faults"]):
            number += 1
            mine = bus["craft"] == craft
            own = [one for one in stretches if mine and (one.craft, one.fault) == (section, place)]
            for first, last in dict.fromkeys(spans(own, KINDS[about["kind"]].frames)):
                begin, end = (time.start_ns + epoch * time.interval_ns - half for epoch in (first, last + 1))
                found.append(Window(number, begin, end))
    return found


def shaded(plots: Iterable[Plot | None], acting: Sequence[Window]) -> list[Plot | None]:
    """Plots with the windows of faults, those over time."""
    return [one if one is None else _shaded(one, acting) for one in plots]


def _shaded(plot: Plot, acting: Sequence[Window]) -> Plot:
    if plot.figure is None or not acting or plot.figure["layout"].get("xaxis", {}).get("type") != "date":
        return plot
    layout = plot.figure["layout"]
    begins = milliseconds(np.array([one.begin_ns for one in acting]))
    ends = milliseconds(np.array([one.end_ns for one in acting]))
    first = {one.number: begin for one, begin in reversed([*zip(acting, begins, strict=True)])}
    together: dict[int, list[int]] = {}
    for number, begin in sorted(first.items())[:_MOST_NAMED]:
        together.setdefault(begin, []).append(number)
    names = [_numbers(numbers, begin) for begin, numbers in together.items()]
    shapes = [_shade(*span) for span in zip(begins[:_MOST_SHADES], ends[:_MOST_SHADES], strict=True)]
    more = {
        "shapes": [*layout.get("shapes", ()), *shapes],
        "annotations": [*layout.get("annotations", ()), *names],
    }
    return replace(plot, figure=plot.figure | {"layout": layout | more})


def _shade(begin_ms: int, end_ms: int) -> Json:
    return {"type": "rect", "xref": "x", "yref": "paper", "x0": begin_ms, "x1": end_ms, "y0": 0, "y1": 1,
            "layer": "below", "fillcolor": "--fault", "line": {"width": 0}}  # fmt: skip


def _numbers(numbers: Sequence[int], begin_ms: int) -> Json:
    """Faults' numbers in the ledger, where they begin."""
    words = ", ".join(map(str, numbers))
    return {"x": begin_ms, "xref": "x", "y": 1, "yref": "paper", "text": words, "showarrow": False,
            "xanchor": "left", "yanchor": "top", "font": {"size": 10, "color": "--bad"}}  # fmt: skip
