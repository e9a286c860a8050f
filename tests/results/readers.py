"""How a figure is read: from summary.json, from tables, from what a command prints, from what it cost."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

POSITION = ("x_ecef_m", "y_ecef_m", "z_ecef_m")


@dataclass(frozen=True, slots=True)
class Played:
    """What a command left behind.

    folder     its run folder
    output     what it printed, both streams
    elapsed_s  wall time; cpu_s: user and system, of it and its children; peak_mb: of its largest process
    """

    folder: Path
    output: str
    elapsed_s: float
    cpu_s: float
    peak_mb: float


Reader = Callable[[Played], float]


def summary(path: str) -> Reader:
    """A number of summary.json by its path, `*` for the only craft."""

    def read(played: Played) -> float:
        node: Any = json.loads((played.folder / "summary.json").read_text("utf-8"))
        for part in path.split("."):
            node = next(iter(node.values())) if part == "*" else node[part]
        return float(node)

    return read


def printed(pattern: str, group: int = 1, number: int = 0) -> Reader:
    """A number that the command printed: a group of a regular expression, of its first or another match."""

    def read(played: Played) -> float:
        found = list(re.finditer(pattern, played.output, re.M))
        if len(found) <= number:
            raise ValueError(f"no match of {pattern!r} in {played.output[-2000:]!r}")
        return float(re.sub(r"[ ,]", "", found[number][group]))

    return read


def largest_printed(pattern: str) -> Reader:
    """The largest of all numbers that match."""
    return lambda played: max(float(found) for found in re.findall(pattern, played.output, re.M))


def elapsed(played: Played) -> float:
    return played.elapsed_s


def peak_mb(played: Played) -> float:
    return played.peak_mb


def cpu_us_per_epoch(played: Played) -> float:
    """User and system time of the whole command over the epochs of its run [us]."""
    return 1e6 * played.cpu_s / summary("epochs")(played)


def errors_m(folder: Path, from_s: float = 0.0, until_s: float = np.inf) -> tuple[np.ndarray, int]:
    """3-D errors of the fixes of a stretch of the run [m], and how many epochs of it have none."""
    fixes = pl.read_parquet(folder / "fixes.parquet", columns=["t_gps_s", "valid", *POSITION])
    truth = pl.read_parquet(folder / "truth.parquet", columns=["t_gps_s", *POSITION])
    both = fixes.join(truth, on="t_gps_s", suffix="_true")
    since_s = both["t_gps_s"].to_numpy() - both["t_gps_s"][0]
    both = both.filter(pl.Series((since_s >= from_s) & (since_s < until_s)))
    good = both.filter(pl.col("valid"))
    off = np.stack([good[axis] - good[f"{axis}_true"] for axis in POSITION], axis=1)
    return np.linalg.norm(off, axis=1), len(both) - len(good)


def worst_m(from_s: float, until_s: float) -> Reader:
    """Largest 3-D error of a stretch [m]."""
    return lambda played: float(errors_m(played.folder, from_s, until_s)[0].max())


def without_fix(from_s: float, until_s: float) -> Reader:
    """Epochs of a stretch that have no fix."""
    return lambda played: float(errors_m(played.folder, from_s, until_s)[1])


def apart_mm(one: str, other: str) -> Reader:
    """Largest distance between the fixes of two runs in the folder [mm]."""

    def read(played: Played) -> float:
        runs = [pl.read_parquet(played.folder / name / "fixes.parquet") for name in (one, other)]
        both = runs[0].join(runs[1], on="t_gps_s", suffix="_other").filter("valid", "valid_other")
        off = np.stack([both[axis] - both[f"{axis}_other"] for axis in POSITION], axis=1)
        return float(1e3 * np.linalg.norm(off, axis=1).max())

    return read


def in_view(receiver: int, after_s: float, until_s: float, which: Callable[[pl.Series], Any]) -> Reader:
    """Smallest or largest number of satellites that a receiver's channels hold in a stretch."""

    def read(played: Played) -> float:
        channels = pl.read_parquet(played.folder / "channels.parquet")
        since = pl.col("t_gps_s") - channels["t_gps_s"].min()
        held = channels.filter(pl.col("receiver") == receiver, since >= after_s, since < until_s)
        return float(which(held.group_by("t_gps_s").len()["len"]))

    return read


def study(factor: str, column: str) -> Reader:
    """A figure of `gnss-hil study factors`."""

    def read(played: Played) -> float:
        rows = json.loads((played.folder / "factors.json").read_text("utf-8"))
        return float(next(row[column] for row in rows if row["factor"] == factor))

    return read
