"""The receiver of examples/receiver_py as tests use it: where it is, how it starts, what its truth says."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import polars as pl

from tests.system.feeder import ROOT
from tools.cli import main

EXAMPLE = ROOT / "examples" / "receiver_py"
PROGRAM = EXAMPLE / "receiver.py"
VEHICLE = EXAMPLE / "single.toml"
AXES = ("x_ecef_m", "y_ecef_m", "z_ecef_m")
SPEEDS = ("vx_ecef_mps", "vy_ecef_mps", "vz_ecef_mps")


def played(folder: Path, epochs: int, *more: str) -> pl.DataFrame:
    """A run with the example as emulator, into folder/run: `errors` of the fixes."""
    truth, run = folder / "truth.csv", folder / "run"
    command = shlex.join([sys.executable, str(PROGRAM), str(truth)])
    words = ["--vehicle", str(VEHICLE), "--duration", str(epochs), "--out", str(run), "--quiet", *more]
    assert main(["run", "soyuz", "--emulator", command, *words]) == 0
    return errors(pl.read_parquet(run / "fixes.parquet"), truth)


def start(told: Mapping[str, str], *truth: Path) -> subprocess.Popen:
    """The program by itself, with what it is told in the environment."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("GNSS_HIL_")}
    return subprocess.Popen(
        [sys.executable, PROGRAM, *truth], env={**clean, **told}, stderr=subprocess.PIPE, text=True
    )


def errors(fixes: pl.DataFrame, truth: Path) -> pl.DataFrame:
    """Distances of fixes from the truth file, nan where there was no fix: position_m, velocity_mps."""
    both = fixes.join(pl.read_csv(truth).cast(pl.Float64), on="t_gps_s", suffix="_true")

    def distance(names):
        return sum((pl.col(name) - pl.col(f"{name}_true")) ** 2 for name in names).sqrt()

    return both.select("t_gps_s", "valid", position_m=distance(AXES), velocity_mps=distance(SPEEDS))
