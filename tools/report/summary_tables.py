"""The summary's figures as tables and tiles of a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from gnss_hil.tools.report.document import note
from gnss_hil.tools.report.markup import Markup, table, tag, text
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


def craft_table(figures: Summary) -> Markup:
    """Statistics of one craft, and what its assignment took."""
    rows = [
        (label, *(shown(figures[key][name]) if name in figures[key] else "" for name in _STATISTICS))
        for key, label in _ROWS
    ]
    a = figures["assignment"]
    assignment = note(
        f"{figure(a['commands'])} commands ({figure(a['repeats'])} repeated), "
        f"{figure(a['handovers'])} handovers, {figure(a['rejected'])} rejected."
    )
    return text((table(("", *_STATISTICS), rows), assignment))


def tiles(rows: Iterable[tuple[str, str]]) -> Markup:
    """Figures in large letters, each with what it is."""
    cells = (tag.div(tag.b(value), tag.span(words), class_="tile") for value, words in rows)
    return tag.div(cells, class_="tiles")


def craft_tiles(figures: Summary, epochs: int) -> Markup:
    error, pdop, used = figures["position_error_m"], figures["pdop"], figures["satellites_tracked"]
    fixes = figures["fixes"]
    span = f"{shown(used['min'])} to {shown(used['max'])}"
    return tiles(
        (
            (f"{percent(fixes, epochs)} %", f"epochs with a fix, {figure(fixes)} of {figure(epochs)}"),
            (shown(used["mean"]), f"satellites in the fix, mean; {span}"),
            (shown(pdop["median"]), f"PDOP, median; p95 {shown(pdop['p95'])}"),
            (shown(error["median"], "m"), f"position error, median; p95 {shown(error['p95'], 'm')}"),
        )
    )


def bus_tiles(s: Summary) -> Markup:
    load, latency, frames = s["bus_load_percent"], s["epoch_latency_ms"], s["frames"]
    lost, refused = frames["lost"], sum(frames["rejected"].values())
    p50, p99 = (shown(latency[name], "ms") for name in ("p50", "p99"))
    return tiles(
        (
            (shown(load["mean"], "%"), f"bus load, mean; {shown(load['max'], '%')} at most"),
            (p50, f"latency of an epoch, median; p99 {p99}"),
            (figure(frames["received"]), f"frames heard of {figure(frames['sent'])} sent"),
            (figure(lost + refused), f"frames lost or refused: {figure(lost)} and {figure(refused)}"),
        )
    )


def shown(value: float | int | None, unit: str = "") -> str:
    """A count as it is, a measure with three digits, with its unit; '-' for what there is not."""
    digits = figure(value) if value is None or isinstance(value, int) else small(value)
    return digits if value is None or not unit else f"{digits} {unit}"


def aligned(rows: Iterable[Sequence[str]]) -> str:
    """Cells in columns for a terminal, the first flush left, the others right."""
    rows = list(rows)
    first, *others = (max(map(len, column)) for column in zip(*rows, strict=True))
    return "\n".join(
        f"{name:<{first}}" + "".join(f"  {cell:>{width}}" for cell, width in zip(cells, others, strict=True))
        for name, *cells in rows
    )


def expectations(s: Summary) -> Markup:
    if not s["expectations"]:
        return note("The scenario expects nothing; this run is not judged.")
    rows = [
        (row["name"], *("" if row.get(k) is None else f"{row[k]:g}" for k in ("min", "max")),
         "no figure" if row["found"] is None else f"{row['found']:g}", "met" if row["met"] else "MISSED")
        for row in s["expectations"]
    ]  # fmt: skip
    return table(("figure", "at least", "at most", "found", "verdict"), rows)


def faults(s: Summary) -> Markup:
    lost, rejected = s["frames"]["lost"], s["frames"]["rejected"]
    if not rejected and not lost:
        return note("No frame was lost and none was refused.")
    rows = [("lost (missing by the counters)", figure(lost))]
    rows += [(f"refused: {why.replace('_', ' ').lower()}", figure(n)) for why, n in rejected.items()]
    return table(("frame faults", "frames"), rows)


def verdict(s: Summary) -> Markup | None:
    """One badge: what to think of the run before reading on."""
    every = s["expectations"]
    missed = sum(not row["met"] for row in every)
    if s["interrupted"]:
        words = "interrupted before its end"
    elif missed:
        words = f"{missed} of {len(every)} expectations missed"
    elif every:
        return tag.p(f"all {len(every)} expectations met", class_="verdict good")
    else:
        return None
    return tag.p(words, class_="verdict bad")
