"""Vertical electron content from measured maps, between their nodes and epochs.

In place bilinear; in time linear between two maps that have been turned with the Sun: of each map the place
is read that had the same local time at its epoch.
Source: S. Schaer, W. Gurtner, J. Feltens, IONEX: The IONosphere Map EXchange Format Version 1 (1998), section
3, "interpolate between consecutive rotated TEC maps"
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64

_DAY_S = 86_400.0


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """Maps on one grid: latitudes rise by a constant step, longitudes go once around.

    first_ns  GPS time of the first map [ns];  interval_s  between maps [s];  count  of maps
    south_rad, lat_step_rad, rows;  west_rad, lon_step_rad, columns   geocentric, [rad]; the meridian that
              ends the circle is not there twice
    vtec_tecu (count * rows * columns,) [TECU], in that order
    """

    first_ns: int
    interval_s: float
    count: int
    south_rad: float
    lat_step_rad: float
    rows: int
    west_rad: float
    lon_step_rad: float
    columns: int
    vtec_tecu: F64

    @property
    def last_ns(self) -> int:
        return self.first_ns + round(self.interval_s * (self.count - 1) * 1e9)


def vertical_tecu(maps: Maps, t_ns: int, later_s: F64 | float, lat_rad: F64, lon_rad: F64) -> F64:
    """Vertical content [TECU] over places (...,) at t_ns + later_s; beyond the last row of a map, that row's.

    Times outside the maps are extrapolated; the assembly of a run refuses them.
    """
    since_s = (t_ns - maps.first_ns) * 1e-9 + np.asarray(later_s)
    before = np.minimum(np.maximum((since_s / maps.interval_s).astype(np.int64), 0), maps.count - 2)
    elapsed_s = since_s - before * maps.interval_s
    weight = elapsed_s / maps.interval_s
    row = (lat_rad - maps.south_rad) / maps.lat_step_rad
    row = np.minimum(np.maximum(row, 0.0), maps.rows - 1.0)
    i = np.minimum(row.astype(np.int64), maps.rows - 2)
    north = row - i
    per_s = 2 * np.pi / _DAY_S
    total = 0.0
    for later, share in ((0, 1 - weight), (1, weight)):
        column = (lon_rad + per_s * (elapsed_s - later * maps.interval_s) - maps.west_rad) / maps.lon_step_rad
        whole = np.floor(column)
        east = column - whole
        j = whole.astype(np.int64) % maps.columns
        k = np.where(j == maps.columns - 1, 0, j + 1)
        start = ((before + later) * maps.rows + i) * maps.columns
        v, stride = maps.vtec_tecu, maps.columns
        south = v[start + j] * (1 - east) + v[start + k] * east
        upper = v[start + stride + j] * (1 - east) + v[start + stride + k] * east
        total = total + share * (south + north * (upper - south))
    return total
