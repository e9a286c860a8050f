"""Measured orientation of the Earth: finals2000A files of the IERS Rapid Service.

Behind the measured days stands a year of predicted ones: UT1 of the last is known to some 25 ms, 12 m.

Source: IERS Rapid Service/Prediction Center, readme.finals2000A: columns of pole and UT1 - UTC, bulletin A
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.files.text import FileError, read_text

_MJD_EPOCH = datetime(1858, 11, 17)
_GPS_EPOCH_MJD = 44_244
_ARCSEC_RAD = np.pi / 648_000
# Name, first column (from 1), last column.
_FIELDS = (("MJD", 8, 15), ("PM-x", 19, 27), ("PM-y", 38, 46), ("UT1-UTC", 59, 68))


@dataclass(frozen=True, slots=True, eq=False)
class Orientation:
    """The Earth's pole and angle, daily.

    t_ns          (n,) GPS time [ns], ascending
    ut1_gps_s     (n,) UT1 - GPS, which does not jump at leap seconds [s]
    pole_rad      (n, 2) x and y of the pole in terrestrial axes
    origin        the file's name, for errors
    """

    t_ns: I64
    ut1_gps_s: F64
    pole_rad: F64
    origin: str

    def at(self, t_ns: I64) -> tuple[F64, F64]:
        """UT1 - GPS (...,) [s] and pole (..., 2) [rad] at GPS times t_ns (...,), linear between days: tides
        bend them by some 0.1 ms, 5 cm. Outside the table its ends hold, which `check` refuses of a run."""
        first = self.t_ns[0]
        day = (np.asarray(t_ns) - first) / 86400e9
        days = (self.t_ns - first) / 86400e9
        pole = [np.interp(day, days, axis) for axis in self.pole_rad.T]
        return np.interp(day, days, self.ut1_gps_s), np.stack(pole, axis=-1)

    def check(self, begin_ns: int, end_ns: int) -> None:
        """FileError unless the table holds all of a run."""
        if begin_ns < self.t_ns[0] or end_ns > self.t_ns[-1]:
            first, last = gpstime.iso(int(self.t_ns[0])), gpstime.iso(int(self.t_ns[-1]))
            raise FileError(
                f"{self.origin}: the Earth's orientation from {first} to {last}; the run is from "
                f"{gpstime.iso(begin_ns)} to {gpstime.iso(end_ns)} (GPS time)"
            )


def read(path: Path) -> Orientation:
    """The orientation of a file, gzip or plain, up to its first day without one; FileError in one line."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> Orientation:
    """The orientation in the text of a file; `origin` names it in errors."""
    rows = []
    for n, line in enumerate(text.splitlines(), 1):
        if not line[_FIELDS[-1][1] - 1 : _FIELDS[-1][2]].strip():
            break
        rows.append([_number(line, *field, f"{origin}: line {n}") for field in _FIELDS])
        if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
            raise FileError(f"{origin}: line {n}: MJD is {rows[-1][0]:g}, after {rows[-2][0]:g}")
    table = np.reshape(rows, (-1, len(_FIELDS)))
    # Before GPS time began there are no leap seconds of it.
    mjd, x, y, ut1_utc_s = table[table[:, 0] >= _GPS_EPOCH_MJD].T
    if len(mjd) < 2:
        raise FileError(f"{origin}: {len(mjd)} days with UT1-UTC since 1980-01-06; two at least are needed")
    t_ns = np.array([gpstime.from_utc(_MJD_EPOCH + timedelta(days=float(day))) for day in mjd])
    leap_s = np.array([gpstime.leap_seconds(int(t)) for t in t_ns])
    return Orientation(t_ns, ut1_utc_s - leap_s, _ARCSEC_RAD * np.stack((x, y), axis=1), origin)


_LIMITS = {"MJD": (41_000, 100_000), "PM-x": (-2, 2), "PM-y": (-2, 2), "UT1-UTC": (-1, 1)}


def _number(line: str, name: str, first: int, last: int, where: str) -> float:
    cell = line[first - 1 : last].strip()
    low, high = _LIMITS[name]
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not low <= value <= high:
        raise FileError(
            f"{where}: {name} is '{cell}'; a number from {low} to {high} in columns {first}-{last}"
        )
    return value
