"""summary.json: what a run showed, from the bus and the truth alone, and what was expected of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.decoder.counters import total
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results.truth import Truth


def _number(value) -> float | int | None:
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


def statistics(values, names: Sequence[str]) -> dict[str, float | int | None]:
    """Named statistics of the values that are there; null where there are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return {name: _number(_STATISTICS[name](values)) if len(values) else None for name in names}


def errors_against_truth(fixes: Mapping[str, np.ndarray], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """3-D position [m] and velocity [m/s] errors of valid fixes that truth knows the instant of; nan for the
    velocity of a fix without one."""
    valid = fixes["valid"]
    t_ns = fixes["t_ns"][valid]
    if not len(rows) or not len(t_ns):
        return np.zeros(0), np.zeros(0)
    at = np.minimum(np.searchsorted(rows["t_gps_ns"], t_ns), len(rows) - 1)
    found = rows["t_gps_ns"][at] == t_ns
    position = np.column_stack([fixes[f"{a}_m"][valid] for a in "xyz"])[found]
    velocity = np.column_stack([fixes[f"v{a}_mps"][valid] for a in "xyz"])[found]
    rows = rows[at[found]]
    return (
        np.linalg.norm(position - rows["position_ecef_m"], axis=1),
        np.linalg.norm(velocity - rows["velocity_ecef_mps"], axis=1),
    )


def craft_summary(digest: Digest, rows: np.ndarray) -> dict[str, Any]:
    """The figures of one craft."""
    fixes = digest.fixes
    log = digest.commands
    valid = fixes["valid"] if fixes else np.zeros(0, bool)
    position_m, velocity_mps = errors_against_truth(fixes, rows) if fixes else (np.zeros(0), np.zeros(0))

    def of_fixes(name):
        return fixes[name][valid] if fixes else np.zeros(0)

    return {
        "fixes": int(valid.sum()),
        "satellites_visible": statistics(rows["satellites_visible"] if len(rows) else [], _SPREAD),
        "satellites_tracked": statistics(of_fixes("satellites_used"), _SPREAD),
        "measurements": statistics(of_fixes("measurements"), _SPREAD),
        "pdop": statistics(of_fixes("pdop"), _QUALITY),
        "pdop_distinct": statistics(of_fixes("pdop_distinct"), _QUALITY),
        "position_error_m": statistics(position_m, _ERROR),
        "velocity_error_mps": statistics(velocity_mps, _ERROR),
        "assignment": {
            "commands": log.commands,
            "repeats": log.repeats,
            "handovers": log.handovers,
            "rejected": log.rejected,
        },
    }


def load_percent(digests: Mapping[str, Digest], interval_s: float) -> dict[str, float | None]:
    """Bus load of the epochs, exact bits at the contract's rate; the busiest bus counts."""
    loads = [d.bits / (interval_s * BIT_RATE) * 100 for d in digests.values()]
    busiest = max(loads, key=lambda x: x.sum(), default=np.zeros(0))
    return statistics(busiest, ("mean", "max"))


def build(facts: Mapping[str, Any], digests: Mapping[str, Digest], truth: Truth | None) -> dict[str, Any]:
    """The summary of a run.

    facts    what only the run itself knows: scenario, seed, policy, ..., real_time_factor, epoch_latency_ms
    digests  by craft name

    At a free pace bench frames need no answer: there unanswered epochs are no figure.
    """
    rows = {name: truth.of(name) if truth and name in truth.craft else np.zeros(0) for name in digests}
    figures = {name: craft_summary(digest, rows[name]) for name, digest in digests.items()}
    return {
        **{k: v for k, v in facts.items() if k not in ("expect", "frames_sent", "latency_histogram")},
        "epochs_unanswered": facts["epochs_unanswered"] if facts["pace"] == "lockstep" else None,
        "frames": total(d.counters for d in digests.values()).figures(facts.get("frames_sent")),
        "bus_load_percent": load_percent(digests, facts["epoch_interval_s"]),
        "expectations": judge(facts.get("expect", {}), figures),
        "craft": figures,
    }


def metrics(figures: Mapping[str, Any], path: str = "") -> dict[str, float | int | None]:
    """Figures by dotted name, as expectations call them."""
    flat: dict[str, float | int | None] = {}
    for key, value in figures.items():
        name = f"{path}.{key}" if path else key
        flat |= metrics(value, name) if isinstance(value, Mapping) else {name: value}
    return flat


def metric_names(craft: Sequence[str], codec: Codec) -> set[str]:
    """Every name an expectation may use: those of a summary without a frame."""
    return set(metrics(dict.fromkeys(craft, craft_summary(Digest(codec), np.zeros(0)))))


def judge(expect: Mapping[str, Mapping[str, float]], figures: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One row per expectation: name, limits, the figure found, met or not. No figure means not met."""
    found = metrics(figures)
    rows = []
    for name, limits in expect.items():
        value = found.get(name)
        met = value is not None and limits.get("min", -np.inf) <= value <= limits.get("max", np.inf)
        rows.append({"name": name, **limits, "found": value, "met": bool(met)})
    return rows
