"""The summary's figures as tables and tiles of a page."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from gnss_hil.tools.report.document import note, table
from gnss_hil.tools.results.text import figure, percent, small

Summary = Mapping[str, Any]

_STATISTICS = ("mean", "median", "rms", "p95", "min", "max")
_ROWS = (
    ("satellites_visible", "satellites in view"),
    ("satellites_tracked", "satellites in the fix, distinct"),
    ("measurements", "measurements in the fix"),
    ("pdop", "PDOP"),
    ("pdop_distinct", "PDOP, each satellite once"),
    ("position_error_m", "position error, 3-D [m]"),
    ("velocity_error_mps", "velocity error, 3-D [m/s]"),
)


def craft_table(figures: Summary) -> str:
    """Statistics of one craft."""
    rows = [
        [label, *(_shown(figures[key][name]) if name in figures[key] else "" for name in _STATISTICS)]
        for key, label in _ROWS
    ]
    return table(["", *_STATISTICS], rows)


def assignment_line(figures: Summary) -> str:
    a = figures["assignment"]
    return (
        f"{figure(a['commands'])} commands ({figure(a['repeats'])} repeated), "
        f"{figure(a['handovers'])} handovers, {figure(a['rejected'])} rejected."
    )


def tiles(rows: list[tuple[str, str]]) -> str:
    cells = (
        f'<div class="tile"><b>{escape(value)}</b><span>{escape(words)}</span></div>' for value, words in rows
    )
    return f'<div class="tiles">{"".join(cells)}</div>'


def craft_tiles(figures: Summary, epochs: int) -> list[tuple[str, str]]:
    error, pdop, held = figures["position_error_m"], figures["pdop"], figures["satellites_tracked"]
    return [
        (
            f"{percent(figures['fixes'], epochs)} %",
            f"epochs with a fix, {figure(figures['fixes'])} of {figure(epochs)}",
        ),
        (
            _shown(held["mean"]),
            f"satellites in the fix, mean; {_shown(held['min'])} to {_shown(held['max'])}",
        ),
        (_shown(pdop["median"]), f"PDOP, median; p95 {_shown(pdop['p95'])}"),
        (_unit(error["median"], "m"), f"position error, median; p95 {_unit(error['p95'], 'm')}"),
    ]


def bus_tiles(s: Summary) -> list[tuple[str, str]]:
    load, latency, frames = s["bus_load_percent"], s["epoch_latency_ms"], s["frames"]
    refused = sum(frames["rejected"].values())
    return [
        (_unit(load["mean"], "%"), f"bus load, mean; {_unit(load['max'], '%')} at most"),
        (_unit(latency["p50"], "ms"), f"latency of an epoch, median; p99 {_unit(latency['p99'], 'ms')}"),
        (figure(frames["received"]), f"frames heard of {figure(frames['sent'])} sent"),
        (
            figure(frames["lost"] + refused),
            f"frames lost or refused: {figure(frames['lost'])} and {figure(refused)}",
        ),
    ]


def _shown(value) -> str:
    """A count as it is, a measure with three digits."""
    return figure(value) if isinstance(value, int) else small(value)


def _unit(value, unit: str) -> str:
    return "-" if value is None else f"{_shown(value)} {unit}"


def expectations(s: Summary) -> str:
    if not s["expectations"]:
        return note("The scenario expects nothing; this run is not judged.")
    rows = [
        [row["name"], *("" if row.get(k) is None else f"{row[k]:g}" for k in ("min", "max")),
         "no figure" if row["found"] is None else f"{row['found']:g}", "met" if row["met"] else "MISSED"]
        for row in s["expectations"]
    ]  # fmt: skip
    return table(["figure", "at least", "at most", "found", "verdict"], rows)


def faults(s: Summary) -> str:
    frames = s["frames"]
    if not frames["rejected"] and not frames["lost"]:
        return note("No frame was lost and none was refused.")
    rows = [["lost (missing by the counters)", figure(frames["lost"])]]
    rows += [
        [f"refused: {reason.replace('_', ' ').lower()}", figure(n)]
        for reason, n in frames["rejected"].items()
    ]
    return table(["frame faults", "frames"], rows)


def verdict(s: Summary) -> str:
    """One badge: what to think of the run before reading on."""
    missed = [row for row in s["expectations"] if not row["met"]]
    if s["interrupted"]:
        words, good = "interrupted before its end", False
    elif missed:
        words, good = f"{len(missed)} of {len(s['expectations'])} expectations missed", False
    elif s["expectations"]:
        words, good = f"all {len(s['expectations'])} expectations met", True
    else:
        return ""
    return f'<p class="verdict {"good" if good else "bad"}">{words}</p>'
