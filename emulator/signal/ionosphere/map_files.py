"""Maps of files that follow each other as one field of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.files import ionex
from gnss_hil.emulator.files.columns import nothing_but_nines
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.signal.ionosphere.maps import Maps


def joined(files: Sequence[ionex.TecMaps], origin: str, span_ns: tuple[int, int]) -> Maps:
    """Maps of files that follow each other, on one grid around the Earth, evenly spaced, without gaps.

    The map that ends a day and the one that begins the next may both be there: the later file's counts.
    """
    first = files[0]
    _check_grids(files, origin)
    of_time = {
        gpstime.from_utc(t): v for maps in files for t, v in zip(maps.epoch, maps.vtec_tecu, strict=True)
    }
    times = np.array(sorted(of_time))
    _check_times(times, origin, span_ns)
    values = np.array([of_time[t] for t in times.tolist()])
    _check_values(times, first, values, origin)
    return _gridded(times, first, values)


def _check_grids(files: Sequence[ionex.TecMaps], origin: str) -> None:
    first = files[0]
    alike = all(
        np.array_equal(maps.lat_deg, first.lat_deg) and np.array_equal(maps.lon_deg, first.lon_deg)
        for maps in files
    )
    if not alike:
        raise FileError(f"{origin}: grids of the files differ")
    if abs(np.ptp(first.lon_deg) - 360) > 1e-6:
        raise FileError(
            f"{origin}: longitudes span {np.ptp(first.lon_deg):g} deg; maps go once around the Earth"
        )


def _check_times(times: I64, origin: str, span_ns: tuple[int, int]) -> None:
    steps = np.unique(np.diff(times))
    # A leap second makes one step longer; nothing moves that fast up there.
    if len(steps) == 0 or np.ptp(steps) > 1_000_000_000:
        raise FileError(f"{origin}: maps are not evenly spaced in time")
    if span_ns[0] < times[0] or span_ns[1] > times[-1]:
        raise FileError(
            f"{origin}: maps from {gpstime.iso(int(times[0]))} to {gpstime.iso(int(times[-1]))}; "
            f"the run is from {gpstime.iso(span_ns[0])} to {gpstime.iso(span_ns[1])} (GPS time)"
        )


def _check_values(times: I64, grid: ionex.TecMaps, values: F64, origin: str) -> None:
    if np.isnan(values).any():
        at, i, j = np.argwhere(np.isnan(values))[0]
        place = f"latitude {grid.lat_deg[i]:g}, longitude {grid.lon_deg[j]:g}"
        raise FileError(
            f"{origin}: map of {gpstime.iso(int(times[at]))} has no value at {place}: gaps are not filled"
        )
    first = values[:, 0, 0]
    even = np.ptp(values.reshape(len(values), -1), axis=1) == 0
    none = even & ((first <= 0) | nothing_but_nines(first, range(2, 5), 1))
    if none.all() or (none.any() and not even.all()):
        at = int(np.argmax(none))
        raise FileError(
            f"{origin}: map of {gpstime.iso(int(times[at]))} has {first[at]:g} TECU everywhere, which stands "
            "for none: gaps are not filled"
        )


def _gridded(times: I64, grid: ionex.TecMaps, values: F64) -> Maps:
    """Values (t, i, j) on the grid of a file, in the order of rising latitudes and longitudes; the meridian
    that ends the circle is left out."""
    south = np.argsort(grid.lat_deg)
    west = np.argsort(grid.lon_deg)[:-1]
    return Maps(
        first_ns=int(times[0]),
        interval_s=float(np.median(np.diff(times))) * 1e-9,
        count=len(times),
        south_rad=float(np.deg2rad(grid.lat_deg[south[0]])),
        lat_step_rad=float(np.deg2rad(abs(grid.lat_deg[1] - grid.lat_deg[0]))),
        rows=len(south),
        west_rad=float(np.deg2rad(grid.lon_deg[west[0]])),
        lon_step_rad=float(np.deg2rad(abs(grid.lon_deg[1] - grid.lon_deg[0]))),
        columns=len(west),
        vtec_tecu=np.ascontiguousarray(values[:, south][:, :, west]).ravel(),
    )
