"""What became of the faults of a run folder, by its tables: seen by which check, when, at what cost.

A fix is that of the epoch whose mark it carries, and errs against the truth of that epoch: where a mark shows
a wrong time and is believed, the fix is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.tools.results import faults, parquet
from gnss_hil.tools.results.expectations import Finding, Fixes, Verdict, finding, verdicts

_AXES = ("x_ecef_m", "y_ecef_m", "z_ecef_m")


@dataclass(frozen=True, slots=True)
class Judged:
    """A fault on a craft's bus: what became of it, None if it never acted, and its expectations."""

    craft: str
    fault: str
    kind: str
    found: Finding | None
    verdicts: tuple[Verdict, ...]

    @property
    def met(self) -> bool:
        """Whether all that was expected of it came about."""
        return all(one.met for one in self.verdicts)


def judge(folder: Path, given: Sequence[Fault]) -> list[Judged]:
    """Of each fault on each craft's bus; none without faults.

    given   the run's faults in the order of its scenario
    """
    armed, stretches = faults.read(folder)
    found: list[Judged] = []
    for number, bus in enumerate(armed):
        craft = bus["craft"]
        mine = [one for one in given if one.craft in (None, craft)]
        fixes, seen = fixes_of(folder, craft), seen_in(folder, craft)
        for place, (fault, about) in enumerate(zip(mine, bus["faults"], strict=True)):
            own = [one for one in stretches if (one.craft, one.fault) == (number, place)]
            what = finding(fault.expect, own, fixes, seen, KINDS[fault.kind].frames)
            rows = tuple(verdicts(fault.expect, what))
            found.append(Judged(craft, about["name"], fault.kind, what, rows))
    return found


def fixes_of(folder: Path, craft: str) -> Fixes:
    """A craft's fixes by epoch, with their errors where the truth is known."""
    marks = parquet.of_craft(folder / "epochs.parquet", craft, ("t_gps_s", "epoch"))
    rows = parquet.of_craft(folder / "fixes.parquet", craft, ("t_gps_s", "valid", *_AXES))
    epoch_at = dict(zip(marks["t_gps_s"].tolist(), marks["epoch"].astype(int).tolist(), strict=True))
    epoch = np.array([epoch_at.get(t, -1) for t in rows["t_gps_s"].tolist()], np.int64)
    there = epoch >= 0
    epoch, valid = epoch[there], rows["valid"][there].astype(bool)
    fixed = np.column_stack([rows[axis][there] for axis in _AXES])
    error_m = np.full(len(epoch), np.nan)
    if (folder / "truth.parquet").exists():
        truth = parquet.of_craft(folder / "truth.parquet", craft, _AXES)
        true = np.column_stack([truth[axis] for axis in _AXES])
        known = valid & (epoch < len(true))
        error_m[known] = np.linalg.norm(fixed[known] - true[epoch[known]], axis=1)
    return Fixes(epoch, valid, error_m)


def seen_in(folder: Path, craft: str) -> dict[str, I64]:
    """Epochs in which each check of checks.parquet saw something, by the names that faults are expected to be
    detected by: WRONG_SEQUENCE is wrong-sequence."""
    epochs: dict[str, list[I64]] = {}
    for batch in parquet.batches_of_craft(folder / "checks.parquet", craft, ("check", "epoch")):
        check, epoch = parquet.text(batch, "check"), parquet.numbers(batch, "epoch")
        for code in np.unique(check.codes).tolist():
            name = check.labels[code].lower().replace("_", "-")
            own = epoch[check.codes == code]
            epochs.setdefault(name, []).append(own[np.isfinite(own)].astype(np.int64))
    return {name: np.concatenate(pieces) for name, pieces in epochs.items()}
