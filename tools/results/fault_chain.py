"""How far faults came on one craft: frames, checks, measurements, fixes, counted from the tables of its run.

The epochs are those in which faults acted and as many behind each, as in the ledger.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.checks import BENCH, EXCLUDED_SATELLITE, REJECTIONS, UNHEALTHY
from gnss_hil.tools.results.expectations import behind
from gnss_hil.tools.results.outages import REASONS as NO_FIX

_NOT_SOUND = ("NO_ORBIT", "MOVED")
_WHY_LEFT_OUT = {
    **dict.fromkeys(_NOT_SOUND, "satellite elsewhere"),
    EXCLUDED_SATELLITE: "contradict the rest",
    UNHEALTHY: "unhealthy",
}
"""Why a measurement is in no fix, by the checks that tell."""
NO_FIX_MADE, OTHERWISE = "no fix made", "not wanted"


@dataclass(frozen=True, slots=True)
class Stage:
    """A link of the chain: how much came to it, what becomes of what goes on, and how much ended there, by
    why, most first."""

    name: str
    came: int
    on: str
    ended: Mapping[str, int]

    @property
    def goes_on(self) -> int:
        return max(0, self.came - sum(self.ended.values()))


def chain(folder: Path, craft: str, ledger: Sequence[Mapping[str, Any]], epochs: int) -> list[Stage]:
    """Of the faults of a craft, `ledger` as summary.json has it, in a run of so many epochs; none where none
    acted. Without a table of channels measurements are left out."""
    acted = [row for row in ledger if row["craft"] == craft and row["first_epoch"] is not None]
    if not acted:
        return []
    spans = [(row["first_epoch"], behind(row["first_epoch"], row["last_epoch"])) for row in acted]
    marks = parquet.of_craft(folder / "epochs.parquet", craft, ("t_gps_s", "epoch"))
    times_s = marks["t_gps_s"][_within(marks["epoch"], spans)]
    seen = _seen(folder, craft, spans)
    touched = sum(row["frames"]["touched"] for row in acted)
    missing = sum(row["frames"]["missing"] for row in acted)
    refused = {name: seen[name, BENCH] for name in (*REJECTIONS, BENCH) if seen[name, BENCH]}
    fixed_s = _fixed(folder, craft, times_s)
    stages = [
        Stage("frames touched", touched, "came", {"did not come": missing} if missing else {}),
        Stage(
            "frames at the checks",
            max(touched - missing, sum(refused.values())),
            "let through",
            _ordered({"of the bench" if name == BENCH else name: n for name, n in refused.items()}),
        ),
    ]
    if (folder / "channels.parquet").exists():
        stages.append(_measurements(folder, craft, times_s, fixed_s, seen))
    why = Counter({name: seen[name, "no fix"] for name in NO_FIX})
    lasted = int(_within(np.arange(epochs, dtype=float), spans).sum())
    return [*stages, Stage("epochs", lasted, "with a fix", _capped(why, lasted - len(fixed_s), "no mark"))]


def _within(epoch: F64, spans: Iterable[tuple[int, int]]) -> Bool:
    """(n,) which epochs are in any of some spans, both ends included."""
    inside = np.zeros(len(epoch), bool)
    for first, last in spans:
        inside |= (epoch >= first) & (epoch <= last)
    return inside


def _seen(folder: Path, craft: str, spans: Sequence[tuple[int, int]]) -> Counter[tuple[str, str]]:
    """Counts of checks.parquet by check and by whom; reasons of epochs without a fix by "no fix"."""
    found: Counter[tuple[str, str]] = Counter()
    names = ("check", "where", "by", "epoch", "count")
    for batch in parquet.batches_of_craft(folder / "checks.parquet", craft, names):
        inside = _within(parquet.numbers(batch, "epoch"), spans)
        labels = [parquet.text(batch, name)[inside] for name in ("check", "where", "by")]
        check, where, by = (np.array(one.labels, object)[one.codes].tolist() for one in labels)
        for name, place, who, count in zip(
            check, where, by, parquet.numbers(batch, "count")[inside].tolist(), strict=True
        ):
            of = "no fix" if name in NO_FIX and place == "FLIGHT" else who
            found[name, of] += int(count)
    return found


def _fixed(folder: Path, craft: str, times_s: F64) -> F64:
    """Those of some instants that have a fix."""
    fixes = parquet.of_craft(folder / "fixes.parquet", craft, ("t_gps_s", "valid"))
    return np.intersect1d(times_s, fixes["t_gps_s"][fixes["valid"].astype(bool)])


def _measurements(
    folder: Path, craft: str, times_s: F64, fixed_s: F64, seen: Counter[tuple[str, str]]
) -> Stage:
    rows = parquet.of_craft(folder / "channels.parquet", craft, ("t_gps_s", "used"))
    here = np.isin(rows["t_gps_s"], times_s)
    used, t_s = rows["used"][here].astype(bool), rows["t_gps_s"][here]
    left_out = int((~used).sum())
    without_fix = int((~np.isin(t_s, fixed_s)).sum())
    why: Counter[str] = Counter({NO_FIX_MADE: without_fix})
    for (check, _), count in seen.items():
        if check in _WHY_LEFT_OUT:
            why[_WHY_LEFT_OUT[check]] += count
    return Stage("measurements", len(used), "in a fix", _capped(why, left_out, OTHERWISE))


def _capped(why: Counter[str], total: int, rest: str) -> dict[str, int]:
    """Reasons with counts that make up a total: what is beyond it is cut, what is lacking is the rest."""
    found: Counter[str] = Counter()
    for name, count in why.most_common():
        found[name] = min(count, total - sum(found.values()))
    found[rest] += total - sum(found.values())
    return _ordered(found)


def _ordered(counts: Mapping[str, int]) -> dict[str, int]:
    """Those that are not 0, most first."""
    return {name: n for name, n in sorted(counts.items(), key=lambda row: (-row[1], row[0])) if n > 0}
