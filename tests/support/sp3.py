"""A small reader of SP3-c precise orbits (Hilla, The Extended Standard Product 3 Orbit Format, 2010)."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites, systems


@dataclass(frozen=True, slots=True, eq=False)
class PreciseOrbits:
    """Centres of mass on a (times, satellites) grid; nan where the product has none.

    t_ns (t,) GPS time; index (n,) satellite index; pos_ecef_m (t, n, 3); clock_m (t, n)
    """

    t_ns: np.ndarray
    index: np.ndarray
    pos_ecef_m: np.ndarray
    clock_m: np.ndarray


def read(path: Path, system: int) -> PreciseOrbits:
    """One system's satellites of an SP3 file in GPS time."""
    letter = systems.by_value(system).letter
    rows: dict[tuple[int, int], list[float]] = {}
    t_ns = 0
    for line in gzip.decompress(path.read_bytes()).decode("ascii").splitlines():
        if line.startswith("*"):
            year, month, day, hour, minute = map(int, line[1:19].split()[:5])
            t_ns = gpstime.from_calendar(datetime(year, month, day, hour, minute))
        elif line.startswith(f"P{letter}"):
            x, y, z, clock_us = (float(line[k : k + 14]) for k in (4, 18, 32, 46))
            if (x, y, z) != (0, 0, 0):
                clock_m = np.nan if clock_us >= 999999 else clock_us * 1e-6 * 299_792_458.0
                rows[t_ns, int(satellites.index(system, int(line[2:4])))] = [
                    1e3 * x,
                    1e3 * y,
                    1e3 * z,
                    clock_m,
                ]
    times = np.array(sorted({t for t, _ in rows}))
    index = np.array(sorted({s for _, s in rows}))
    grid = np.full((len(times), len(index), 4), np.nan)
    for (t, s), values in rows.items():
        grid[np.searchsorted(times, t), np.searchsorted(index, s)] = values
    return PreciseOrbits(times, index, grid[..., :3], grid[..., 3])
