"""The programs as tests start them: the beginnings of command lines."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
"""The checkout."""

GNSS_HIL = (sys.executable, "-m", "gnss_hil.tools.command_line.main")
EMULATOR = (sys.executable, "-P", "-m", "gnss_hil.emulator")
FLIGHT = (sys.executable, "-P", "-m", "gnss_hil.flightsw")

PROGRAM = shutil.which("gnss-hil", path=str(Path(sys.executable).parent))
"""`gnss-hil` as installed."""
