"""What the fix leaves of the ranges it was made from: by satellite, over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.satellites import name as satellite_name
from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternions
from gnss_hil.flightsw.measurement.range_model import rays
from gnss_hil.tools.report.plot import Json, Plot, array2d, axis, moments, time_axis
from gnss_hil.tools.results.figures import small

_COLUMNS = 180
"""Stretches of time of the picture."""
_LEAST = 3
"""Ranges of one clock and system whose median says something."""


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """Code ranges of the systems' first signals, with what their channels sent beside them, (n,) rows.

    mark         row of the time mark;  receiver 1-based;  used  in the fix, or nobody says
    corrected_m  pseudorange, satellite clock added
    place_m      (n, 3) satellite at transmission, ECEF of that instant
    """

    mark: I64
    receiver: I64
    satellite: I64
    used: Bool
    corrected_m: F64
    place_m: F64

    def __getitem__(self, rows) -> Ranges:
        return Ranges(*(getattr(self, name)[rows] for name in self.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Measured minus predicted [m], (n,): mark, satellite, whether it was in the fix."""

    mark: I64
    satellite: I64
    used: Bool
    value_m: F64


def residuals(ranges: Ranges, position_m: F64, quaternion: F64, vehicle: Vehicle) -> Residuals:
    """Of ranges at marks with a fix (e, 3) and an attitude (e, 4).

    Clocks are not taken from the fix, which reports one: of the ranges of one mark, oscillator and system the
    median of those in the fix is taken off.
    """
    body = dcm_of_quaternions(quaternion[ranges.mark])
    lever = np.einsum("nji,nj->ni", body, vehicle.lever_arm_body_m[ranges.receiver - 1])
    antenna = position_m[ranges.mark] + lever
    there = np.isfinite(antenna).all(axis=1)
    raw = np.full(len(ranges.mark), np.nan)
    raw[there] = ranges.corrected_m[there] - rays(ranges.place_m[there].T, antenna[there].T).range_m
    clock = vehicle.clock_domain[ranges.receiver - 1] * 64 + satellites.system_of(ranges.satellite)
    group = ranges.mark * 512 + clock
    return Residuals(ranges.mark, ranges.satellite, ranges.used, raw - _median_of(group, raw, ranges.used))


def _median_of(group: I64, value: F64, counts: Bool) -> F64:
    """(n,) median of the group's values that count; nan where they are few."""
    rows = np.flatnonzero(counts & np.isfinite(value))
    rows = rows[np.lexsort((value[rows], group[rows]))]
    names, first, size = np.unique(group[rows], return_index=True, return_counts=True)
    if not len(names):
        return np.full(len(value), np.nan)
    ordered = value[rows]
    middle = (ordered[first + (size - 1) // 2] + ordered[first + size // 2]) / 2
    middle[size < _LEAST] = np.nan
    at = np.minimum(np.searchsorted(names, group), len(names) - 1)
    return np.where(names[at] == group, middle[at], np.nan)


def picture(t_ns: I64, found: Residuals, marks: int, shapes: list[Json], listed: bool = True) -> Plot:
    """A row for each satellite, a column for each stretch of time: means as colours. `marks` of the run's
    t_ns (e,) were looked at; `listed` is whether fixes say which ranges they are of."""
    title = "Residuals"
    known = np.flatnonzero(np.isfinite(found.value_m))
    if not len(known):
        return Plot.missing(title, "No epoch has a fix, an attitude and enough ranges.")
    value, mark = found.value_m[known], found.mark[known]
    rows, row = np.unique(found.satellite[known], return_inverse=True)
    row = len(rows) - 1 - row  # GPS on top
    columns = min(_COLUMNS, marks)
    column = (mark * columns) // len(t_ns)
    total, count = np.zeros((2, len(rows), columns))
    np.add.at(total, (row, column), value)
    np.add.at(count, (row, column), 1)
    mean = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
    limit = float(np.nanpercentile(np.abs(mean), 98)) or 1e-3
    names = [satellite_name(s) for s in rows[::-1]]
    starts = t_ns[np.arange(columns) * len(t_ns) // columns]
    data = [{
        "type": "heatmap", "x": moments(starts), "y": list(range(len(rows))), "z": array2d(mean),
        "zmin": -limit, "zmax": limit, "hoverongaps": False,
        "colorscale": [[0, "--low"], [0.5, "--paper"], [1, "--high"]],
        "colorbar": {"title": {"text": "m", "side": "top"}, "thickness": 10, "outlinewidth": 0, "xpad": 4},
        "customdata": [[name] * columns for name in names],
        "hovertemplate": "%{customdata} %{x|%H:%M:%S}: %{z:.3f} m<extra></extra>",
    }]  # fmt: skip
    y = axis("satellite", tickvals=list(range(len(rows))), ticktext=names, showgrid=False, zeroline=False,
             range=[-0.5, len(rows) - 0.5], tickfont={"size": 10})  # fmt: skip
    rms = np.sqrt(np.mean(value[found.used[known]] ** 2)) if found.used[known].any() else np.nan
    of = "in the fix" if listed else "of all, as fixes do not say which they are of,"
    return Plot(
        title,
        f"Pseudorange minus what the fix predicts, by satellite, mean of stretches of time; rms {of} "
        f"{small(float(rms))} m; {_worst(rows, found.satellite[known], value)}. Clocks are taken off "
        f"by the median of each oscillator and system. Grey: not measured.{_looked(marks, len(t_ns))}",
        {"data": data, "layout": {"xaxis": time_axis(t_ns, showgrid=False), "yaxis": y, "shapes": shapes,
                                  "plot_bgcolor": "--idle"}},
        height=150 + 13 * len(rows), wide=True,
    )  # fmt: skip


def _worst(rows: I64, satellite: I64, value: F64) -> str:
    """The satellites that are furthest off, on the mean of the run."""
    mean = np.array([value[satellite == s].mean() for s in rows])
    order = np.argsort(-np.abs(mean))[:3]
    words = ", ".join(f"{satellite_name(int(rows[k]))} {mean[k]:+.2f} m" for k in order)
    return f"furthest off on the mean {words}"


def _looked(marks: int, epochs: int) -> str:
    return "" if marks >= epochs else f" Of {marks} epochs, evenly spread."
