"""summary.json: what a run showed, from the bus and the truth alone, and what was expected of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.counters import total
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import consistency, outages
from gnss_hil.tools.results import truth as truths
from gnss_hil.tools.results.truth import Truth


def number(value) -> float | int | None:
    """A figure as JSON carries it: nan becomes null, floats keep seven digits."""
    if value is None or not np.isfinite(value):
        return None
    return int(value) if float(value).is_integer() and abs(value) < 2**53 else float(f"{value:.7g}")


_STATISTICS = {
    "mean": np.mean,
    "min": np.min,
    "max": np.max,
    "median": np.median,
    "rms": lambda x: np.sqrt(np.mean(np.square(x))),
    "p50": np.median,
    "p95": lambda x: np.percentile(x, 95),
    "p99": lambda x: np.percentile(x, 99),
}
_SPREAD = ("mean", "min", "max")
_QUALITY = ("median", "p95")
_ERROR = ("median", "rms", "p95", "max")
_OF_THE_RUN_ALONE = (
    "expect", "faults", "bench_frames_refused_in", "frames_sent", "latency_histogram", "about", "fixes_flown",
    "record",
)  # fmt: skip
"""Of run.json, what summary.json does not repeat."""
_NEES = ("position", "velocity", "clock")
LIGHT_MPS = 299_792_458.0
_NEVER_NS = 2**63 - 1


_STATED_BY = {
    "NAV_USED": "satellites_used",
    "NAV_CLOCK": "clock_bias_m",
    "NAV_DRIFT": "clock_drift_mps",
    "NAV_SIGMA": "sigma_x_m",
    "NAV_CORR": "rho_xy",
    "NAV_VSIGMA": "sigma_vx_mps",
    "NAV_VCORR": "rho_vxy",
    "NAV_CLOCK_SIGMA": "sigma_clock_bias_m",
}
"""What a fix may come without, and the column of fixes that is nan then."""
_OF_A_VELOCITY = ("NAV_DRIFT", "NAV_VSIGMA", "NAV_VCORR")


def statistics(values, names: Sequence[str]) -> dict[str, float | int | None]:
    """Named statistics of the values that are there; null where there are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return {name: number(_STATISTICS[name](values)) if len(values) else None for name in names}


def stated(values: np.ndarray) -> np.ndarray:
    """Of fixes, what counts satellites or measurements or is a dilution: none is 0, so who sends 0 does not
    state it: nan."""
    return np.where(values > 0, values, np.nan)


def satellites_in_fix(listed: np.ndarray, published: np.ndarray) -> np.ndarray:
    """Distinct satellites of fixes: those that NAV_USED lists, else as NAV_STATUS counts them; nan where
    nobody says."""
    return np.where(np.isnan(listed), stated(published), listed)


def not_sent(fixes: Mapping[str, np.ndarray]) -> dict[str, int]:
    """How many of the valid fixes came without a kind of frame that says more of them."""
    if not fixes:
        return dict.fromkeys(_STATED_BY, 0)
    moving = fixes["valid"] & ~np.isnan(fixes["vx_mps"])
    return {
        kind: int(np.isnan(fixes[name][moving if kind in _OF_A_VELOCITY else fixes["valid"]]).sum())
        for kind, name in _STATED_BY.items()
    }


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Of valid fixes of whose instant truth is known; nan for the velocity of a fix without one.

    position_m, velocity_mps (n,)   3-D
    nees    name -> (n,) normalised squared errors of position, velocity and clock
    """

    position_m: np.ndarray
    velocity_mps: np.ndarray
    nees: Mapping[str, np.ndarray]


def errors_against_truth(fixes: Mapping[str, np.ndarray], rows: np.ndarray) -> Errors:
    """Of fixes, and truth."""
    none = np.zeros(0)
    fixes, rows = truths.at_fixes(fixes, rows)
    if not len(rows):
        return Errors(none, none, dict.fromkeys(_NEES, none))
    position = np.column_stack([fixes[f"{a}_m"] for a in "xyz"]) - rows["position_ecef_m"]
    velocity = np.column_stack([fixes[f"v{a}_mps"] for a in "xyz"]) - rows["velocity_ecef_mps"]
    return Errors(
        np.linalg.norm(position, axis=1),
        np.linalg.norm(velocity, axis=1),
        {
            "position": consistency.position_nees(fixes, position),
            "velocity": consistency.velocity_nees(fixes, velocity),
            "clock": consistency.clock_nees(
                fixes, LIGHT_MPS * consistency.clock_of_fix(fixes, rows["clock_s"])
            ),
        },
    )


def craft_summary(
    digest: Digest, rows: np.ndarray, epochs: int = 0, interval_ns: int = NS_PER_S
) -> dict[str, Any]:
    """The figures of one craft in a run of so many epochs: of all of it, and after convergence."""
    log, timeline, fixes = digest.commands, digest.timeline, digest.fixes
    marks_ns = timeline.get("t_ns", np.zeros(0, np.int64))
    first_ns = outages.first_fix_ns(fixes)
    first_s = None if first_ns is None else (first_ns - int(marks_ns[0])) / NS_PER_S
    lacking = outages.without_fix(timeline, fixes)
    stretches = outages.stretches(marks_ns, fixes, interval_ns)
    after_s = None if first_s is None else first_s + outages.CONVERGENCE_S
    return {
        **fix_figures(digest, rows, epochs),
        "excluded_by_name": excluded_by_name(fixes),
        "first_fix_s": number(first_s),
        "outages": outages.outages(stretches, first_ns, interval_ns),
        "without_fix": {
            "epochs_with_refused_frames": int((timeline["faults"][lacking] > 0).sum()) if timeline else 0,
            "satellites_measured": statistics(
                timeline["satellites_measured"][lacking] if timeline else [], _SPREAD
            ),
        },
        "fixes_without": not_sent(fixes),
        "converged": {"after_s": number(after_s), **figures_after(digest, rows, after_s)},
        "assignment": {
            "commands": log.commands,
            "repeats": log.repeats,
            "handovers": log.handovers,
            "rejected": log.rejected,
        },
    }


def fix_figures(digest: Digest, rows: np.ndarray, epochs: int, since_ns: int | None = None) -> dict[str, Any]:
    """Figures of the fixes, and of the epochs that have none, of all epochs or of those since an instant."""
    fixes = digest.fixes
    if since_ns is not None:
        fixes = {name: column[_since(fixes["t_ns"], since_ns)] for name, column in fixes.items()}
    valid = fixes["valid"] if fixes else np.zeros(0, bool)
    errors = errors_against_truth(fixes, rows)
    unknown = int(valid.sum()) - int(np.isfinite(errors.position_m).sum())
    there = bool(len(rows)) and bool(np.isfinite(rows["position_ecef_m"]).any())
    if since_ns is not None:
        rows = rows[rows["t_gps_ns"] >= since_ns] if len(rows) else rows

    def of_fixes(name):
        return fixes[name][valid] if fixes else np.zeros(0)

    return {
        "fixes": int(valid.sum()),
        "no_fix": outages.reasons(fixes, epochs),
        "satellites_visible": statistics(rows["satellites_visible"] if len(rows) else [], _SPREAD),
        "satellites_tracked": statistics(
            satellites_in_fix(of_fixes("satellites_used"), of_fixes("satellites")), _SPREAD
        ),
        "satellites_paired": statistics(of_fixes("satellites_paired"), _SPREAD),
        "measurements": statistics(stated(of_fixes("measurements")), _SPREAD),
        "tested": {name: int((of_fixes("tested") == raw).sum()) for raw, name in VALUES["Tested"].items()},
        "excluded": {
            "epochs": int(_excluding(fixes).sum()),
            "satellites": int(of_fixes("excluded_satellites").sum()),
            "receivers": int(of_fixes("excluded_receivers").sum()),
        },
        "pdop": statistics(stated(of_fixes("pdop")), _QUALITY),
        "pdop_distinct": statistics(of_fixes("pdop_distinct"), _QUALITY),
        "position_error_m": statistics(errors.position_m, _ERROR),
        "velocity_error_mps": statistics(errors.velocity_mps, _ERROR),
        "errors_unknown": unknown if there else None,
        "nees": {name: statistics(values, ("mean",))["mean"] for name, values in errors.nees.items()},
    }


def _excluding(fixes: Mapping[str, np.ndarray]) -> np.ndarray:
    """(n,) which navigation blocks are fixes of which something was left out."""
    if not fixes:
        return np.zeros(0, bool)
    return fixes["valid"] & (fixes["excluded_satellites"] + fixes["excluded_receivers"] > 0)


def excluded_by_name(fixes: Mapping[str, np.ndarray]) -> dict[str, int]:
    """In how many epochs each satellite and receiver was left out, as far as it can be told; most first."""
    if not fixes:
        return {}
    named = Counter(name for names in fixes["excluded"].tolist() for name in names.split())
    return dict(sorted(named.items(), key=lambda row: (-row[1], row[0])))


def figures_after(digest: Digest, rows: np.ndarray, after_s: float | None) -> dict[str, Any]:
    """`fix_figures` from so long after the first time mark on, and how many epochs that are; None: of no
    epoch."""
    marks_ns = digest.timeline.get("t_ns", np.zeros(0, np.int64))
    begin_ns = int(marks_ns[0]) if len(marks_ns) else 0
    since_ns = _NEVER_NS if after_s is None else begin_ns + round(after_s * NS_PER_S)
    epochs = int(_since(marks_ns, since_ns).sum())
    return {"epochs": epochs, **fix_figures(digest, rows, epochs, since_ns)}


def _since(t_ns: I64, since_ns: int) -> Bool:
    """(n,) which of instants on record come from an instant on; behind it also those whose mark went back."""
    return np.maximum.accumulate(t_ns) >= since_ns


def load_percent(digests: Mapping[str, Digest], interval_s: float) -> dict[str, float | None]:
    """Bus load of the epochs, exact bits at the contract's rate; the busiest bus counts."""
    loads = [d.bits / (interval_s * BIT_RATE) * 100 for d in digests.values()]
    busiest = max(loads, key=lambda x: x.sum(), default=np.zeros(0))
    return statistics(busiest, ("mean", "max"))


def _unanswered(facts: Mapping[str, Any], digests: Mapping[str, Digest]) -> int | None:
    if facts["pace"] in ("lockstep", None):
        return facts["epochs_unanswered"] if facts["pace"] else None
    return sum(digest.epochs - len(digest.fixes.get("t_ns", ())) for digest in digests.values())


def build(facts: Mapping[str, Any], digests: Mapping[str, Digest], truth: Truth | None) -> dict[str, Any]:
    """The summary of a run.

    facts    what only the run itself knows: scenario, seed, policy, ..., real_time_factor, epoch_latency_ms
    digests  by craft name

    At a free pace bench frames need no answer: there epochs are unanswered that have no NAV_STATUS on record.
    """
    rows = {name: truth.of(name) if truth and name in truth.craft else np.zeros(0) for name in digests}
    epochs, interval_ns = facts["epochs"], round(facts["epoch_interval_s"] * NS_PER_S)
    figures = {
        name: craft_summary(digest, rows[name], epochs, interval_ns) for name, digest in digests.items()
    }
    summary = {
        **{k: v for k, v in facts.items() if k not in _OF_THE_RUN_ALONE},
        "epochs_unanswered": _unanswered(facts, digests),
        "frames": total(d.counters for d in digests.values()).figures(facts.get("frames_sent")),
        "bus_load_percent": load_percent(digests, facts["epoch_interval_s"]),
        "expectations": [],
        "craft": figures,
    }

    def after(after_s: float) -> dict[str, Any]:
        return metrics({name: figures_after(digest, rows[name], after_s) for name, digest in digests.items()})

    return summary | {"expectations": judge(facts.get("expect", {}), found_by_name(summary), after)}


def metrics(figures: Mapping[str, Any], path: str = "") -> dict[str, float | int | None]:
    """Figures by dotted name, as expectations call them."""
    flat: dict[str, float | int | None] = {}
    for key, value in figures.items():
        name = f"{path}.{key}" if path else key
        flat |= metrics(value, name) if isinstance(value, Mapping) else {name: value}
    return flat


RUN_FIGURES = (
    "epochs", "epochs_unanswered", "real_time_factor", "mark_late_ms",
    "frames.sent", "frames.received", "frames.lost", "frames.rejected",
    "bus_load_percent.mean", "bus_load_percent.max", "epoch_latency_ms.p50", "epoch_latency_ms.p99",
)  # fmt: skip
"""Figures of the run that expectations may name; `frames.rejected` is the sum over all reasons."""


def found_by_name(summary: Mapping[str, Any]) -> dict[str, float | int | None]:
    """Every figure that an expectation may name."""
    refused = {"frames": {**summary["frames"], "rejected": sum(summary["frames"]["rejected"].values())}}
    of_run = metrics({**summary, **refused, "craft": {}, "expectations": {}})
    return {name: of_run.get(name) for name in RUN_FIGURES} | metrics(summary["craft"])


def metric_names(craft: Sequence[str], codec: Codec) -> tuple[set[str], set[str]]:
    """Every name an expectation may use, those of a summary without a frame; and those among them that may
    have `after_s`, because they are made of single epochs."""
    empty, none = Digest(codec), np.zeros(0)
    timed = set(metrics(dict.fromkeys(craft, figures_after(empty, none, None))))
    return {*RUN_FIGURES, *metrics(dict.fromkeys(craft, craft_summary(empty, none))), *timed}, timed


def judge(
    expect: Mapping[str, Mapping[str, float]],
    found: Mapping[str, float | int | None],
    after: Callable[[float], Mapping[str, float | int | None]] = lambda _: {},
) -> list[dict[str, Any]]:
    """One row per expectation: name, limits, the figure found, met or not. No figure means not met.

    found   figures by name;  after   the same of a run's epochs from so many seconds on
    """
    rows = []
    for name, limits in expect.items():
        value = (after(limits["after_s"]) if "after_s" in limits else found).get(name)
        met = value is not None and limits.get("min", -np.inf) <= value <= limits.get("max", np.inf)
        rows.append({"name": name, **limits, "found": value, "met": bool(met)})
    return rows
