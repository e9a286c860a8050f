"""The receiver of examples/receiver_py as tests start it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from tests.support.feeder import ROOT

EXAMPLE = ROOT / "examples" / "receiver_py"
PROGRAM = EXAMPLE / "receiver.py"
VEHICLE = EXAMPLE / "single.toml"


def start(told: Mapping[str, str], *truth: Path) -> subprocess.Popen:
    """The program by itself, with what it is told in the environment."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("GNSS_HIL_")}
    return subprocess.Popen(
        [sys.executable, PROGRAM, *truth], env={**clean, **told}, stderr=subprocess.PIPE, text=True
    )
