"""RTKLIB's command line on the files of an export, and what it found."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime
from tests.support.outside import program
from tests.support.waiting import HANG_S

SETTINGS = Path(__file__).parents[2] / "examples" / "rtklib.conf"

OWN_WEIGHTS = {
    "pos1-sateph": "brdc",
    "pos1-ionoopt": "off",
    "stats-errphase": "0.003",
    "stats-errphaseel": "0.003",
}
"""As RTKLIB weighs by itself: by its elevation model, system, and the accuracy that satellites broadcast."""


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """t_ns (s,) GPS time, position_m (s, 3) ECEF, satellites (s,); what was complained of, line by line."""

    t_ns: np.ndarray
    position_m: np.ndarray
    satellites: np.ndarray
    complaints: list[str]


def solve(folder: Path, observations: str, **changes: str) -> Solutions:
    """Single-point positions of one observation file in an export folder; changes of settings by name."""
    program("rnx2rtkp", "rtklib", "RTKLIB")
    text = SETTINGS.read_text()
    for key, value in changes.items():
        text, found = re.subn(rf"(?m)^({key} *=).*$", rf"\g<1>{value}", text)
        assert found == 1, key
    settings, out = folder / "rtklib.conf", folder / "rtklib.pos"
    settings.write_text(text)
    files = [observations, "broadcast.nav", "satellites.sp3"]
    done = subprocess.run(
        ["rnx2rtkp", "-k", settings.name, "-x", "2", "-o", out.name, *files],
        cwd=folder, capture_output=True, text=True, timeout=HANG_S, check=True,
    )  # fmt: skip
    said = [line for line in re.split(r"[\r\n]+", done.stderr) if line.strip()]
    complaints = [line for line in said if not line.startswith(("processing", "reading"))]
    complaints += (folder / f"{out.name}.trace").read_text().splitlines()
    rows = [line.split() for line in out.read_text().splitlines() if not line.startswith("%")]
    return Solutions(
        np.array([_t_ns(row[0], row[1]) for row in rows], np.int64),
        np.array([row[2:5] for row in rows], float).reshape(-1, 3),
        np.array([row[6] for row in rows], int),
        complaints,
    )


def _t_ns(date: str, time: str) -> int:
    return gpstime.from_calendar(datetime.strptime(f"{date} {time}", "%Y/%m/%d %H:%M:%S.%f"))
