"""Where a craft was, in time: its fixes, or the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.export.run_data import CraftData
from gnss_hil.tools.recording.run_folder import TRUTH
from gnss_hil.tools.results import truth


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """One craft's centre of mass, WGS-84 ECEF, ascending in time.

    t_ns           (n,) GPS time [ns]
    position_m, velocity_mps   (n, 3), velocity relative to the Earth, nan where there is none
    source         what it is, in words
    """

    name: str
    t_ns: NDArray[np.int64]
    position_m: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    source: str


def of_fixes(data: Sequence[CraftData]) -> list[TimeSeries]:
    """Fixes as the flight software published them."""
    return [
        _placed(h.name, h.t_ns, h.position_m, h.velocity_mps, "fixes of the flight software") for h in data
    ]


def of_truth(folder: Path, data: Sequence[CraftData]) -> list[TimeSeries]:
    """Truth at the epochs; Mistake where the run has none."""
    if not (folder / TRUTH).is_file():
        raise Mistake(f"{folder}: has no {TRUTH}: it does not tell where the craft really was")
    stream = truth.read(folder / TRUTH)
    series = []
    for h in data:
        if h.name not in stream.craft:
            raise Mistake(f"{folder / TRUTH}: has no craft {h.name}")
        rows = stream.of(h.name)
        state = rows["position_ecef_m"], rows["velocity_ecef_mps"]
        series.append(_placed(h.name, rows["t_gps_ns"], *state, "truth of the emulator"))
    return series


def _placed(name: str, t_ns, position_m, velocity_mps, source: str) -> TimeSeries:
    there = ~np.isnan(position_m).any(axis=1)
    return TimeSeries(name, t_ns[there], position_m[there], velocity_mps[there], source)
