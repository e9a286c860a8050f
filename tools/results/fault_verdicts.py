"""What became of the faults of a run folder, by its tables: seen by which check, when, at what cost.

A fix carries no time: it is of the time that the mark of its epoch shows, and errs against the truth at that
time. Where a mark shows a wrong time and is believed, the fix is wrong by as far as the craft went.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.ledger import Stretch
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.tools.results import detectors, faults, parquet, trajectory
from gnss_hil.tools.results.checks import BENCH, FLIGHT, REJECTIONS
from gnss_hil.tools.results.detectors import Sign
from gnss_hil.tools.results.expectations import Finding, Fixes, Verdict, behind, finding, span, verdicts
from gnss_hil.tools.results.reach import Reach, reach
from gnss_hil.tools.results.summary import number

_AXES = ("x_ecef_m", "y_ecef_m", "z_ecef_m")


@dataclass(frozen=True, slots=True)
class Frames:
    """Of a fault: frames that it touched, those that did not come for it, those that the protection refused
    at its places while it lasted and as long behind it, and those that were left, to be used; and how many
    values no bits could carry, for which the nearest that they can was sent."""

    touched: int
    missing: int
    refused: int
    let_through: int
    clipped: int


@dataclass(frozen=True, slots=True)
class Judged:
    """A fault on a craft's bus: what became of it, None if it never acted, and its expectations.

    acted   first and last epoch
    """

    craft: str
    fault: str
    kind: str
    place: str
    acted: tuple[int, int] | None
    frames: Frames
    found: Finding | None
    verdicts: tuple[Verdict, ...]

    @property
    def met(self) -> bool:
        """Whether all that was expected of it came about."""
        return all(one.met for one in self.verdicts)


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What checks.parquet has of a craft: what was seen by each word, and how many frames, those of the bench
    too, were refused in which epochs, by whom (the bench's checks, the flight software's) and by where."""

    signs: Sequence[Sign]
    refused: Mapping[tuple[str, str], Mapping[int, int]]

    def refused_at(self, reach: Reach, first: int, last: int) -> int:
        """Frames refused at a fault's places from one epoch to another: by the bench's checks or by the
        flight software's, which tells of the most frequent, whichever are more."""
        counts: dict[str, Counter[int]] = {BENCH: Counter(), FLIGHT: Counter()}
        for (by, where), by_epoch in self.refused.items():
            if reach.has_frames(where):
                counts[by].update({e: n for e, n in by_epoch.items() if first <= e <= last})
        epochs = {*counts[BENCH], *counts[FLIGHT]}
        return sum(max(counts[BENCH][epoch], counts[FLIGHT][epoch]) for epoch in epochs)


def judge(folder: Path, given: Sequence[Fault], antennas: Mapping[str, Sequence[str]]) -> list[Judged]:
    """Of each fault on each craft's bus; none without faults.

    given      the run's faults in the order of its scenario
    antennas   their names, by craft
    """
    armed, stretches = faults.read(folder)
    found: list[Judged] = []
    for section, bus in enumerate(armed):
        craft = bus["craft"]
        mine = [one for one in given if one.craft in (None, craft)]
        fixes, seen = fixes_of(folder, craft), seen_in(folder, craft)
        own = [
            [one for one in stretches if (one.craft, one.fault) == (section, place)]
            for place in range(len(mine))
        ]
        spans = [span(some, KINDS[one.kind].frames) for one, some in zip(mine, own, strict=True)]
        for place, (fault, about) in enumerate(zip(mine, bus["faults"], strict=True)):
            others = [one for k, one in enumerate(spans) if one is not None and k != place]
            its = reach(fault, antennas[craft])
            signs = [one for one in seen.signs if its.has(one)]
            what = finding(fault.expect, own[place], fixes, signs, KINDS[fault.kind].frames, others)
            rows = tuple(verdicts(fault.expect, what))
            acted = spans[place]
            said = (about["name"], about["kind"], about["place"])
            found.append(Judged(craft, *said, acted, _frames(own[place], acted, seen, its), what, rows))
    return found


def _frames(own: Sequence[Stretch], acted: tuple[int, int] | None, seen: Seen, its: Reach) -> Frames:
    """Counts of a fault within its windows."""
    if acted is None:
        return Frames(0, 0, 0, 0, 0)
    first, last = acted
    touched, missing = (
        sum(counts) for counts in zip(*((s.touched, s.missing) for s in own if s.active), strict=True)
    )
    refused = seen.refused_at(its, first, behind(first, last))
    clipped = sum(one.clipped for one in own if one.active)
    return Frames(touched, missing, refused, max(0, touched - missing - refused), clipped)


def rows(judged: Sequence[Judged]) -> list[dict[str, Any]]:
    """As summary.json has them; null for what is not known."""
    return [
        {
            "craft": one.craft,
            "fault": one.fault,
            "kind": one.kind,
            "place": one.place,
            "first_epoch": one.acted[0] if one.acted else None,
            "last_epoch": one.acted[1] if one.acted else None,
            "frames": asdict(one.frames),
            "detected_by": one.found.detected_by if one.found else None,
            "after_epochs": one.found.after_epochs if one.found else None,
            "expected_by": one.found.expected_by if one.found else None,
            "expected_after_epochs": one.found.expected_after_epochs if one.found else None,
            "fix_error_m": number(one.found.fix_error_m) if one.found else None,
            "fixes_unjudged": one.found.fixes_unjudged if one.found else None,
            "availability": number(one.found.availability) if one.found else None,
            "expectations": [asdict(verdict) for verdict in one.verdicts],
            "met": one.met,
        }
        for one in judged
    ]


def write(folder: Path, judged: Sequence[Judged]) -> None:
    """faults.parquet with what became of each fault beside its stretches; where there were faults."""
    armed, stretches = faults.read(folder)
    if not armed:
        return
    keys = [(section, place) for section, bus in enumerate(armed) for place in range(len(bus["faults"]))]
    fate = dict(zip(keys, judged, strict=True))
    of = [fate[one.craft, one.fault] for one in stretches]
    parquet.write(folder / faults.TABLE, [{**faults.columns(armed, stretches), **_found(of)}])


def _found(of: Sequence[Judged]) -> dict[str, parquet.Column]:
    """Columns (n,) of what became of faults: detected_by, after_epochs, expected_by, expected_after_epochs,
    fix_error_m, fixes_unjudged, availability, met."""
    found = [one.found or Finding(None, None, float("nan"), float("nan")) for one in of]
    return {
        "detected_by": _words([one.detected_by for one in found]),
        "after_epochs": _epochs([one.after_epochs for one in found]),
        "expected_by": _words([one.expected_by for one in found]),
        "expected_after_epochs": _epochs([one.expected_after_epochs for one in found]),
        "fix_error_m": np.array([one.fix_error_m for one in found], float),
        "fixes_unjudged": np.array([one.fixes_unjudged for one in found], np.int64),
        "availability": np.array([one.availability for one in found], float),
        "met": parquet.Partial(
            np.array([one.met for one in of], bool), np.array([bool(one.verdicts) for one in of], bool)
        ),
    }


def _words(given: Sequence[str | None]) -> parquet.Labelled:
    words = sorted({one for one in given if one})
    return parquet.Labelled(
        np.array([words.index(one) if one else -1 for one in given], np.int64), tuple(words)
    )


def _epochs(given: Sequence[int | None]) -> parquet.Partial:
    values = np.array([-1 if one is None else one for one in given], np.int64)
    return parquet.Partial(values, values >= 0)


def fixes_of(folder: Path, craft: str) -> Fixes:
    """A craft's fixes by epoch, with their errors where the truth at their time is known."""
    rows = parquet.of_craft(folder / "fixes.parquet", craft, ("t_gps_s", "epoch", "valid", *_AXES))
    there = np.isfinite(rows["epoch"])
    epoch, valid = rows["epoch"][there].astype(np.int64), rows["valid"][there].astype(bool)
    fixed = np.column_stack([rows[axis][there] for axis in _AXES])
    error_m = np.full(len(epoch), np.nan)
    if (folder / "truth.parquet").exists():
        truth = parquet.of_craft(folder / "truth.parquet", craft, trajectory.COLUMNS)
        true, _ = trajectory.of_table(truth, rows["t_gps_s"][there])
        error_m = np.where(valid, np.linalg.norm(fixed - true, axis=1), np.nan)
    return Fixes(epoch, valid, error_m)


def seen_in(folder: Path, craft: str) -> Seen:
    """What checks.parquet has of a craft."""
    epochs: dict[tuple[str, str, str], list[I64]] = {}
    refused: defaultdict[tuple[str, str], Counter[int]] = defaultdict(Counter)
    names = ("check", "where", "by", "epoch", "count")
    for batch in parquet.batches_of_craft(folder / "checks.parquet", craft, names):
        labels = [parquet.text(batch, name) for name in names[:3]]
        epoch, count = parquet.numbers(batch, "epoch"), parquet.numbers(batch, "count")
        known = np.isfinite(epoch)
        epoch = np.where(known, epoch, -1).astype(np.int64)
        codes = np.stack([one.codes[known] for one in labels]).astype(np.int64)
        found, place = np.unique(codes, axis=1, return_inverse=True)
        for row, key in enumerate(found.T.tolist()):
            check, where, by = (one.labels[code] for one, code in zip(labels, key, strict=True))
            mine = known.nonzero()[0][place.ravel() == row]
            epochs.setdefault((check, where, by), []).append(epoch[mine])
            if check in (*REJECTIONS, BENCH):
                refused[by, where].update(dict(zip(*_sums(epoch[mine], count[mine]), strict=True)))
    seen = {key: np.concatenate(pieces) for key, pieces in epochs.items()}
    return Seen(detectors.signs(seen), refused)


def _sums(key: I64, values: F64) -> tuple[list[int], list[int]]:
    """Keys (n,), each once, and the sums of their values (n,)."""
    found, place = np.unique(key, return_inverse=True)
    return found.tolist(), np.bincount(place, values).astype(int).tolist()
