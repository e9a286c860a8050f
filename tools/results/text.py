"""The summary as a person reads it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gnss_hil.dbc.common.counts import noun
from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.results.fault_text import fault_missed, faults
from gnss_hil.tools.results.figures import figure, percent, small

REPLAY_OF = "replay of "
"""So begins what a summary has as the emulator where a recording was played."""


def _spread(s: Mapping[str, Any]) -> str:
    if s["mean"] is None:
        return "-"
    return f"{s['mean']:6.1f} mean   {s['min']:g} to {s['max']:g}"


def _errors(s: Mapping[str, Any], unit: str) -> str:
    if s["median"] is None:
        return "-"
    return "   ".join(f"{small(s[k]):>7} {k}" for k in ("median", "rms", "p95", "max")) + f"   [{unit}]"


def unknown(c: Mapping[str, Any]) -> str:
    """How many fixes nothing is known of the error of, because their marks show a time that truth does not
    reach; "" if there are none."""
    count = c.get("errors_unknown")
    return (
        f"{figure(count)} {noun(count, 'fix', 'fixes')}, at times that truth does not reach" if count else ""
    )


def no_fix(c: Mapping[str, Any]) -> str:
    """Reasons of a craft's epochs without a fix, the most frequent first; "" if there were none."""
    counts = sorted(c["no_fix"].items(), key=lambda row: -row[1])
    return ", ".join(f"{figure(count)} {reason}" for reason, count in counts if count)


def besides(c: Mapping[str, Any]) -> str:
    """What the bus tells of epochs without a fix besides the flight software's reason."""
    measured, refused = (c["without_fix"][k] for k in ("satellites_measured", "epochs_with_refused_frames"))
    words = []
    if measured["mean"] is not None:
        words.append(f"satellites measured there: {_range(measured)}")
    if refused:
        words.append(f"frames refused in {figure(refused)} of them")
    return "; ".join(words)


def _range(s: Mapping[str, Any]) -> str:
    """From the least to the greatest; one number where they are the same."""
    return f"{s['min']:g}" if s["min"] == s["max"] else f"{s['min']:g} to {s['max']:g}"


def outages(c: Mapping[str, Any]) -> str:
    """Stretches without a fix after the first one; "" if there were none."""
    o = c["outages"]
    if not o["count"]:
        return ""
    count, epochs = figure(o["count"]), figure(o["epochs"])
    return f"{count} after the first fix, {epochs} {noun(o['epochs'], 'epoch')}, longest {o['longest_s']:g} s"


def tested(c: Mapping[str, Any]) -> str:
    """How many fixes were tested how well, the best first."""
    counts = reversed(c["tested"].items())
    return ", ".join(f"{figure(count)} {name.lower()}" for name, count in counts)


MOST_NAMED = 8
"""Satellites and receivers that are named of those that were left out."""


def excluded(c: Mapping[str, Any]) -> str:
    """What was left out of fixes because it contradicts the rest, and how often; "" if nothing was."""
    if not c["excluded"]["epochs"]:
        return ""
    named = [f"{name} {figure(count)}" for name, count in c["excluded_by_name"].items()]
    more = f", and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    which = f": {', '.join(named[:MOST_NAMED])}{more}" if named else ""
    epochs = c["excluded"]["epochs"]
    return f"in {figure(epochs)} {noun(epochs, 'epoch')}{which}"


def _why_no_fix(c: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    first_s, reasons = c["first_fix_s"], no_fix(c)
    yield "  first fix", "never" if first_s is None else f"{first_s:g} s after the first epoch"
    if reasons:
        more = besides(c)
        yield "  no fix", f"{reasons}{f'   ({more})' if more else ''}"
    if text := outages(c):
        yield "  outages", text


def not_sent(c: Mapping[str, Any]) -> str:
    """What the flight software sent with none of its fixes; "" if nothing is missing."""
    lacking = [kind for kind, count in c["fixes_without"].items() if count >= c["fixes"] > 0]
    known = c["satellites_tracked"]["mean"] is not None
    counted = "satellites as NAV_STATUS counts them" if known else "and NAV_STATUS counts no satellites"
    return ", ".join(f"NAV_USED ({counted})" if kind == "NAV_USED" else kind for kind in lacking)


def _distinct(s: Mapping[str, Any]) -> str:
    return _spread(s) + ("" if s["mean"] is None else "   (distinct)")


def _quality(s: Mapping[str, Any]) -> str:
    return "-" if s["median"] is None else f"{small(s['median']):>7} median   {small(s['p95'])} p95"


def _of_epochs(c: Mapping[str, Any], epochs: int) -> str:
    share = f" ({percent(c['fixes'], epochs)} %)" if epochs else ""
    return f"{figure(c['fixes'])} of {figure(epochs)} {noun(epochs, 'epoch')}{share}"


def assignment(c: Mapping[str, Any], replayed: bool) -> str:
    """What was commanded to the channels, and what became of it.

    replayed   a recording has no answers to commands that were not given then
    """
    a = c["assignment"]
    handovers = f"{figure(a['handovers'])} {noun(a['handovers'], 'handover')}"
    commands = f"{figure(a['commands'])} {noun(a['commands'], 'command')}"
    handed = f"{handovers}, {figure(a['rejected'])} refused by receivers"
    if not a["repeats"]:
        return f"{commands}, {handed}"
    why = "as a recording answers only the commands of then" if replayed else "for want of an answer"
    return f"{commands}, sent {figure(a['repeats'])} {noun(a['repeats'], 'time')} again {why}; {handed}"


def replayed(s: Mapping[str, Any]) -> bool:
    """Whether a recording was the emulator."""
    return str(s.get("emulator")).startswith(REPLAY_OF)


def _craft(name: str, c: Mapping[str, Any], s: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    epochs = s["epochs"]
    yield name, ""
    yield "  fixes", _of_epochs(c, epochs)
    yield from _why_no_fix(c)
    yield "  satellites in view", _spread(c["satellites_visible"])
    yield "  satellites in the fix", _distinct(c["satellites_tracked"])
    if c["satellites_paired"]["max"]:
        yield "  of them by two carriers", _spread(c["satellites_paired"])
    yield "  measurements in the fix", _spread(c["measurements"])
    yield "  fixes that were tested", tested(c)
    if text := excluded(c):
        yield "  left out of fixes", text
    yield "  PDOP", _quality(c["pdop"])
    yield "  PDOP, each satellite once", _quality(c["pdop_distinct"])
    yield "  position error, 3-D", _errors(c["position_error_m"], "m")
    yield "  velocity error, 3-D", _errors(c["velocity_error_mps"], "m/s")
    if text := unknown(c):
        yield "  errors unknown", text
    if text := not_sent(c):
        yield "  not sent", text
    yield from _converged(c["converged"])
    yield "  assignment", assignment(c, replayed(s))


def _converged(c: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Figures after convergence, if the run has lasted that long."""
    if not c["epochs"]:
        return
    yield f"  converged, from {c['after_s']:g} s", f"fixes in {_of_epochs(c, c['epochs'])}"
    yield "    satellites in the fix", _distinct(c["satellites_tracked"])
    yield "    position error, 3-D", _errors(c["position_error_m"], "m")
    yield "    velocity error, 3-D", _errors(c["velocity_error_mps"], "m/s")
    if c["nees"]["position"] is not None:
        yield "    squared error by its covariance", _nees(c["nees"])
        if (clock := c["nees"]["clock"]) is not None and not clock_as_said(clock):
            yield "", CLOCK_SAID


CLOCK_SAID = (
    "clock: mostly the delay that all receivers share, one draw a run; none without interchannel_bias "
    "(docs/uncertainty.md)"
)
"""Why the clock's squared error is seldom near 1 in a single run."""
_CLOCK_AS_SAID = 0.2, 4.0


def clock_as_said(squared: float) -> bool:
    """Whether a clock's mean squared error by its variance is so near 1 that nobody asks why."""
    return _CLOCK_AS_SAID[0] <= squared <= _CLOCK_AS_SAID[1]


def _nees(n: Mapping[str, Any]) -> str:
    return (
        f"{small(n['position'])} position, {small(n['velocity'])} velocity (3 is right), "
        f"{small(n['clock'])} clock (1)"
    )


def _bus(s: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    frames, load, latency = s["frames"], s["bus_load_percent"], s["epoch_latency_ms"]
    rejected = sum(frames["rejected"].values())
    reasons = ", ".join(f"{count} {reason}" for reason, count in frames["rejected"].items())
    channel = f":{s['bus']['channel']}" if s["bus"]["channel"] else ""
    known = s["bus"]["interface"] is not None
    yield "bus", f"{s['bus']['interface']}{channel}, {s['pace']}" if known else "unknown: the run broke off"
    yield (
        "  frames",
        f"{figure(frames['received'])} heard of {figure(frames['sent'])} sent, "
        f"{figure(frames['lost'])} lost, {figure(rejected)} rejected{f' ({reasons})' if reasons else ''}",
    )
    yield "  load", f"{small(load['mean']):>7} % mean   {small(load['max'])} % at most"
    yield "  epoch latency", f"{small(latency['p50']):>7} ms p50   {small(latency['p99'])} ms p99"
    if s.get("mark_late_ms") is not None:
        yield "  time marks late", f"{small(s['mark_late_ms']):>7} ms at most"
    if s["epochs_unanswered"]:
        why = ": the run is not reproducible" if s["pace"] == "lockstep" else " without a NAV_STATUS"
        yield "  epochs unanswered", f"{figure(s['epochs_unanswered'])}{why}"


def _ended(s: Mapping[str, Any]) -> str:
    """complete, interrupted or failed."""
    return s.get("ended", "interrupted" if s.get("interrupted") else "complete")


def broken_off(s: Mapping[str, Any]) -> str:
    """How a run ended before its time; "" if it did not."""
    ended = _ended(s)
    if ended == "complete":
        return ""
    planned = s.get("epochs_planned")
    of = f" after {figure(s['epochs'])} of {figure(planned)} {noun(planned, 'epoch')}" if planned else ""
    why = f": {s['failure']}" if s.get("failure") else ""
    return f"{ended}{of}{why}"


def foreign_emulator(s: Mapping[str, Any]) -> bool:
    """Whether another's emulator was played: nothing of the scenario needs to be true of it."""
    return s.get("emulator") not in (None, "ours")


def _other_emulator(s: Mapping[str, Any]) -> str:
    return s["emulator"] if replayed(s) else f"not ours: {s['emulator']}"


def render(s: Mapping[str, Any]) -> str:
    """Aligned lines with units."""
    factor = s["real_time_factor"]
    speed = f", {factor:.0f} times real time" if factor else ""
    ended = _ended(s)
    stopped = "" if ended == "complete" else f" ({ended})"
    epochs = f"{figure(s['epochs'])} {noun(s['epochs'], 'epoch')}"
    rows = [
        ("scenario", f"{s['scenario']}, policy {s['policy']}, seed {s['seed']}"),
        *([("emulator", _other_emulator(s))] if foreign_emulator(s) else []),
        ("simulated", f"{clock(s['duration_s'])} in {epochs}{stopped}{speed}"),
        *([("NOT COMPLETE", broken_off(s))] if broken_off(s) else []),
        *_bus(s),
    ]
    for name, figures in s["craft"].items():
        rows += _craft(name, figures, s)
    for row in s["expectations"]:
        text = f"{row['name']} {_limits(row)}: {_found(row)}"
        rows.append(("expected" if row["met"] else "MISSED", text))
    width = max(len(left) for left, _ in rows) + 2
    lines = [f"{left:<{width}}{right}".rstrip() for left, right in rows]
    return "\n".join([*lines, *faults(s)])


def _limits(row: Mapping[str, Any]) -> str:
    words = {"min": "at least", "max": "at most"}
    limits = " and ".join(f"{word} {row[key]:g}" for key, word in words.items() if key in row)
    return limits if "after_s" not in row else f"from {row['after_s']:g} s on {limits}"


def _found(row: Mapping[str, Any]) -> str:
    return "no figure" if row["found"] is None else f"found {row['found']:g}"


def judged(s: Mapping[str, Any]) -> bool:
    """Whether anything is expected of a run, or of its faults: else nothing can be met."""
    return bool(s["expectations"]) or any(row["expectations"] for row in s.get("faults", ()))


def missed(s: Mapping[str, Any]) -> list[str]:
    """One line for each expectation that was not met, of the scenario and of its faults."""
    of_scenario = [
        f"expectation missed: {row['name']}: {_found(row)}, expected {_limits(row)}"
        for row in s["expectations"]
        if not row["met"]
    ]
    return of_scenario + [line for row in s.get("faults", ()) for line in fault_missed(row)]
