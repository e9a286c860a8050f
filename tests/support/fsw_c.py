"""The flight software in C of examples/fsw_c, built, and its runs compared with ours."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.emulator.config.scenario import find as find_scenario
from tests.support.feeder import (
    ROOT,
)
from tests.support.outside import c_tools

EXAMPLE = ROOT / "examples" / "fsw_c"
AGREEMENT_M = 0.001  # of two least squares with the same weights; found: 0.14 mm, the step of the bus
COPIES_M = 0.01  # where antennas track the same satellites, whose common error each weighs in its own way
EPOCHS = 130


def build(folder: Path, target: str = "all") -> None:
    """`make` into a folder; nothing of the example's own may be warned about."""
    c_tools("gcc", "make", "sha256sum")
    bench = [
        f"PYTHON={sys.executable}",
        f"GNSS_HIL={sys.executable} -m gnss_hil.tools.command_line.main",
        f"BUILD={folder}",
    ]
    done = subprocess.run(
        ["make", "-C", EXAMPLE, "-j2", "CC=gcc", *bench, target], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stderr, done.stderr


def without_figures(folder: Path) -> Path:
    """A scenario as `soyuz`, whose vehicle file says nothing of the receivers: the flight software in C goes
    by its own figures."""
    figures = re.compile(r"^\[receivers\]\n(?:\w+ = .*\n)+", re.M)
    stripped, count = figures.subn("", find("soyuz-ms").read_text())
    assert count == 1
    (folder / "soyuz-ms.toml").write_text(stripped)
    (folder / "soyuz.toml").write_text(find_scenario("soyuz").read_text())
    return folder / "soyuz.toml"


def distances_m(both: pl.DataFrame) -> np.ndarray:
    """Between the positions of two runs, epochs where both have a fix."""
    valid = both.filter(pl.col("valid") & pl.col("valid_other"))
    return np.sqrt(sum((valid[f"{a}_ecef_m"] - valid[f"{a}_ecef_m_other"]).to_numpy() ** 2 for a in "xyz"))
