"""Whether a receiver was in space: its height, by its own ranges.

On the ground a range is longer by the troposphere, 2.4 m at the zenith and 25 m at the horizon, and nothing
here knows of it: fixes would be some 18 m too high. A height to a kilometre tells the one from the other.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import (
    EQUATORIAL_RADIUS_M,
    LIGHT_MPS,
    POLAR_RADIUS_M,
    ROTATION_RPS,
    eci_to_ecef,
)
from gnss_hil.emulator.receivers.observations import Observations

LOWEST_M = 80e3
"""Below it there is air to speak of, and no orbit."""

ENOUGH, _STEPS, _WORST_M = 5, 8, 1e3
_FLATTENED_M = EQUATORIAL_RADIUS_M - POLAR_RADIUS_M


def height_m(seen: Observations) -> float:
    """Height above the ellipsoid by the ranges of an epoch, of the system with most of them, to a kilometre
    [m]; nan where they are fewer than five, or contradict each other."""
    system = satellites.system_of(seen.sat)
    if not len(system):
        return np.nan
    rows = system == np.bincount(system).argmax()
    if len(np.unique(seen.sat[rows])) < ENOUGH:
        return np.nan
    return _solved(seen.pos_ecef_m[rows], (seen.pseudorange_m + seen.clock_m)[rows])


def _solved(sent_ecef_m: F64, range_m: F64) -> float:
    """The height by satellites' places when they sent (n, 3) and ranges less their clocks (n,)."""
    x = np.append(EQUATORIAL_RADIUS_M * _direction(sent_ecef_m), range_m.mean() - 2.2e7)
    left_m = np.full(len(range_m), np.nan)
    for _ in range(_STEPS):
        flight_s = np.linalg.norm(sent_ecef_m - x[:3], axis=1) / LIGHT_MPS
        away_m = eci_to_ecef(sent_ecef_m, ROTATION_RPS * flight_s) - x[:3]
        distance_m = np.linalg.norm(away_m, axis=1)
        design = np.column_stack((-away_m / distance_m[:, None], np.ones(len(range_m))))
        left_m = range_m - distance_m - x[3]
        x = x + np.linalg.lstsq(design, left_m, rcond=None)[0]
    distance_m = np.linalg.norm(x[:3])
    if not np.abs(left_m).max() < _WORST_M or not distance_m > 0:
        return np.nan
    return float(distance_m - EQUATORIAL_RADIUS_M + _FLATTENED_M * (x[2] / distance_m) ** 2)


def _direction(sent_ecef_m: F64) -> F64:
    middle = sent_ecef_m.mean(axis=0)
    return middle / max(np.linalg.norm(middle), 1.0)


def median_height_m(epochs: Iterable[Observations]) -> float:
    """The median over some epochs [m]; nan where none has a height."""
    found = np.array([height_m(seen) for seen in epochs])
    found = found[np.isfinite(found)]
    return float(np.median(found)) if len(found) else np.nan
