"""What a comparison needs of two run folders: figures, fixes in time, settings, and which flight it was."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.run_folder import SCENARIO, SUMMARY
from gnss_hil.tools.results import parquet, trajectory
from gnss_hil.tools.results.assemble import read_facts
from gnss_hil.tools.results.summary import satellites_in_fix, stated


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """One craft's fixes in time, (n,): minutes since the run's first; error_m is None without truth."""

    minutes: F64
    satellites: F64
    pdop: F64
    error_m: F64 | None


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A run folder: its name, its summary, a course for each craft, what it has other than the defaults
    (`provenance.settings`), with the sides that are not ours and its pace, and which flight it is of
    (`_flight_of`)."""

    name: str
    summary: Mapping[str, Any]
    courses: Mapping[str, Course]
    settings: Mapping[str, Any]
    flight: Mapping[str, Any]


def read(folder: Path) -> Run:
    """What a comparison needs of a run folder; Mistake if it is not there."""
    path = folder / SUMMARY
    if not path.is_file():
        raise Mistake(f"{folder}: has no {SUMMARY}; `gnss-hil report {folder}` makes it of a run with a log")
    try:
        summary = json.loads(path.read_bytes())
        crafts = list(summary["craft"])
    except (ValueError, KeyError, TypeError):
        raise Mistake(f"{path}: is damaged; `gnss-hil report {folder}` makes it again") from None
    name = folder.resolve().name
    courses = {craft: course for craft in crafts if (course := _course(folder, craft))}
    return Run(name, summary, courses, _settings(folder, summary), _flight_of(folder, summary))


_OF_THE_CRAFT = ("orbit", "trajectory", "observations", "attitude", "structure")


def _flight_of(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    """What makes a flight one that another may be judged by: what flew, where, when, under which sky and with
    which draws. What a flight software, its receivers and the errors on them are is what one judges."""
    path = folder / SCENARIO
    document = tomllib.loads(path.read_text("utf-8")) if path.is_file() else {}
    craft = {one["name"]: one for one in document.get("craft", ())}
    of_craft = {f"{key} of {name}": one.get(key) for name, one in craft.items() for key in _OF_THE_CRAFT}
    sky = {key: value for key, value in document.get("sky", {}).items() if key != "factors"}
    return {
        "craft": ", ".join(summary["craft"]),
        "emulator": summary.get("emulator"),
        "start": document.get("time", {}).get("start_gps"),
        "sky": sky,
        **of_craft,
        "seed": summary.get("seed"),
    }


RUN_KEYS = ("scenario", "policy", "seed", "duration_s", "epoch_interval_s", "pace", "emulator")
_SAID_BY_THE_RUN = ("seed", "time.duration_s", "time.epoch_interval_s")


def _settings(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    about = (read_facts(folder) or {}).get("about", {})
    own = {key: value for key, value in about.get("settings", {}).items() if key not in _SAID_BY_THE_RUN}
    return {key: summary.get(key) for key in RUN_KEYS} | own


_AXES = tuple(f"{a}_ecef_m" for a in "xyz")


def _table(path: Path, craft: str, names: Sequence[str]) -> dict[str, Any]:
    """Columns of one craft; Mistake if the table is damaged."""
    try:
        return parquet.of_craft(path, craft, names)
    except parquet.Damaged as error:
        raise Mistake(f"{error}; `gnss-hil report {path.parent}` makes it again") from None


def _course(folder: Path, craft: str) -> Course | None:
    fixes, truth = folder / "fixes.parquet", folder / "truth.parquet"
    if not fixes.exists():
        return None
    columns = _table(fixes, craft, ("t_gps_s", "valid", "satellites_used", "satellites", "pdop", *_AXES))
    t_s = columns["t_gps_s"]
    if not len(t_s):
        return None
    valid = columns["valid"]

    def of_fixes(values) -> F64:
        return np.where(valid, values.astype(float), np.nan)

    error = None
    if truth.exists():
        true_m, _ = trajectory.of_table(_table(truth, craft, trajectory.COLUMNS), t_s)
        fixed_m = np.column_stack([columns[name] for name in _AXES])
        error = of_fixes(np.linalg.norm(fixed_m - true_m, axis=1))
    satellites = satellites_in_fix(columns["satellites_used"], columns["satellites"])
    return Course((t_s - t_s[0]) / 60, of_fixes(satellites), of_fixes(stated(columns["pdop"])), error)


def names_of(first: Run, second: Run) -> tuple[str, str]:
    """What the runs are called beside each other."""
    return (first.name, second.name) if first.name != second.name else ("first", "second")
