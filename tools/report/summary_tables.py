"""The summary's figures as tables and tiles of a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.common.gpstime import iso
from gnss_hil.tools.report.document import note
from gnss_hil.tools.report.markup import Markup, table, tag, text
from gnss_hil.tools.results.figures import figure, percent, small
from gnss_hil.tools.results.outages import Stretches
from gnss_hil.tools.results.text import assignment, besides, broken_off, judged, not_sent, outages

Summary = Mapping[str, Any]

_STATISTICS = ("mean", "median", "rms", "p95", "min", "max")
_CONVERGED = ("satellites_tracked", "pdop", "position_error_m", "velocity_error_mps")
_STRETCHES = 10
_ROWS = (
    ("satellites_visible", "satellites in view"),
    ("satellites_tracked", "satellites in the fix, distinct"),
    ("satellites_paired", "of them by two carriers"),
    ("measurements", "measurements in the fix"),
    ("pdop", "PDOP"),
    ("pdop_distinct", "PDOP, each satellite once"),
    ("position_error_m", "position error, 3-D [m]"),
    ("velocity_error_mps", "velocity error, 3-D [m/s]"),
)


def craft_table(figures: Summary, of_recording: bool = False) -> Markup:
    """Statistics of one craft, and what its assignment took; of_recording: a recording was the emulator."""
    settled = figures["converged"]
    paired = bool(figures["satellites_paired"]["max"])
    rows = [_row(figures, key, label) for key, label in _ROWS if paired or key != "satellites_paired"]
    if settled["fixes"]:
        since = f", from {settled['after_s']:g} s on"
        rows += [_row(settled, key, f"{label}{since}") for key, label in _ROWS if key in _CONVERGED]
    commanded = note(f"{assignment(figures, of_recording)}.")
    lacking = not_sent(figures)
    silent = note(f"Not sent with its fixes: {lacking}.") if lacking else None
    return text((table(("", *_STATISTICS), rows), commanded, silent))


def _row(figures: Summary, key: str, label: str) -> tuple[str, ...]:
    return (label, *(shown(figures[key][name]) if name in figures[key] else "" for name in _STATISTICS))


def no_fix_table(figures: Summary, stretches: Stretches) -> Markup:
    """Why epochs have no fix, and the longest stretches of them."""
    first_s = figures["first_fix_s"]
    first = "There was no fix." if first_s is None else f"First fix {first_s:g} s after the first epoch."
    if not any(figures["no_fix"].values()):
        return note(f"{first} Every epoch has one.")
    counts = sorted(figures["no_fix"].items(), key=lambda row: -row[1])
    rows = [(_words(reason), figure(count)) for reason, count in counts if count]
    more = "; ".join(filter(None, (besides(figures), outages(figures))))
    longest = np.sort(np.argsort(-stretches.epochs, kind="stable")[:_STRETCHES])
    where = [
        (iso(t)[11:19], figure(n), _words(stretches.reason[k]))
        for k, t, n in zip(
            longest, stretches.begin_ns[longest].tolist(), stretches.epochs[longest].tolist(), strict=True
        )
    ]
    head = f"the {_STRETCHES} longest of {len(stretches)} from" if len(stretches) > _STRETCHES else "from"
    return text((
        table(("why there is no fix", "epochs"), rows),
        table((head, "epochs", "mostly"), where),
        note(f"{first} {more[:1].upper()}{more[1:]}{'.' if more else ''}"),
    ))  # fmt: skip


def _words(reason: str) -> str:
    return reason.replace("_", " ").lower()


def about(run: Mapping[str, Any]) -> Markup:
    """What was run, by whom, where and when; what it has other than the defaults; the files it read."""
    if not run:
        return note("The run did not note it.")
    host, sides = run["host"], ("flight", "emulator")
    version = f"gnss-hil {run['version']}" + (f", commit {run['commit']}" if run["commit"] else "")
    facts = [
        ("command", run["command"] or "made by a program"),
        *((side, run[side]) for side in sides if run.get(side) not in (None, "ours")),
        ("program", version),
        ("begun", f"{run['begun_utc']} on {host['name']}, {host['system']}, Python {host['python']}"),
    ]
    parts = [table(("", ""), facts, class_="words")]
    if run["settings"]:
        rows = [(key, setting(value)) for key, value in run["settings"].items()]
        parts.append(table(("other than the defaults", ""), rows, class_="words"))
    if run["inputs"]:
        files = [
            (row["file"], row["copy"] or "too large for a copy", figure(row["bytes"]), row["sha256"][:16])
            for row in run["inputs"]
        ]
        parts.append(table(("file", "in the run folder", "bytes", "SHA-256, begins"), files, class_="words"))
    return text(parts)


def setting(value: Any) -> str:
    """A value of a scenario's key, for people; None is the default."""
    if value is None:
        return "default"
    if isinstance(value, bool):
        return "on" if value else "off"
    return ", ".join(map(str, value)) if isinstance(value, list) else f"{value}"


def tiles(rows: Iterable[tuple[str, str]]) -> Markup:
    """Figures in large letters, each with what it is."""
    cells = (tag.div(tag.b(value), tag.span(words), class_="tile") for value, words in rows)
    return tag.div(cells, class_="tiles")


def craft_tiles(figures: Summary, epochs: int) -> Markup:
    fixes, settled = figures["fixes"], figures["converged"]
    converged = settled["fixes"] > 0
    figures = settled if converged else figures
    since = f", from {settled['after_s']:g} s on" if converged else ""
    error, pdop, used = figures["position_error_m"], figures["pdop"], figures["satellites_tracked"]
    span = f"{shown(used['min'])} to {shown(used['max'])}"
    return tiles(
        (
            (f"{percent(fixes, epochs)} %", f"epochs with a fix, {figure(fixes)} of {figure(epochs)}"),
            (shown(used["mean"]), f"satellites in the fix, mean; {span}{since}"),
            (shown(pdop["median"]), f"PDOP, median; p95 {shown(pdop['p95'])}{since}"),
            (shown(error["median"], "m"), f"position error, median; p95 {shown(error['p95'], 'm')}{since}"),
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


NO_FAULTS = "No frame was lost and none was refused."


def expectations(s: Summary) -> Markup | None:
    """What was expected and what became of it; None if nothing was."""
    if not s["expectations"]:
        return None
    rows = [
        (row["name"], f"{row['after_s']:g} s" if "after_s" in row else "",
         *("" if row.get(k) is None else f"{row[k]:g}" for k in ("min", "max")),
         "no figure" if row["found"] is None else f"{row['found']:g}", _met(row["met"]))
        for row in s["expectations"]
    ]  # fmt: skip
    return table(("figure", "from", "at least", "at most", "found", "verdict"), rows)


def nothing_expected(s: Summary) -> str:
    """In words; "" where something is expected of faults."""
    return "" if judged(s) else "The scenario expects nothing; this run is not judged."


def _met(met: bool) -> Markup:
    return tag.b("met", class_="good") if met else tag.b("MISSED", class_="bad")


def faults(s: Summary) -> Markup | None:
    """Frames lost and refused; None if every one came."""
    lost, rejected = s["frames"]["lost"], s["frames"]["rejected"]
    if not rejected and not lost:
        return None
    rows = [("lost (missing by the counters)", figure(lost))]
    rows += [(f"refused: {why.replace('_', ' ').lower()}", figure(n)) for why, n in rejected.items()]
    return table(("frame faults", "frames"), rows)


def verdict(s: Summary) -> Markup | None:
    """One badge: what to think of the run before reading on."""
    every = [*s["expectations"], *(row for row in s.get("faults", ()) if row["expectations"])]
    missed = sum(not row["met"] for row in every)
    if broken := broken_off(s):
        words = f"not complete: {broken}"
    elif missed:
        words = f"{missed} of {so_many(len(every), 'expectation')} missed"
    elif every:
        return tag.p(
            f"all {len(every)} expectations met" if len(every) > 1 else "the one expectation is met",
            class_="verdict good",
        )
    else:
        return None
    return tag.p(words, class_="verdict bad")
