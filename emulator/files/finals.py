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

_PREDICTED = 57
"""Column, from 0, of the flag of UT1-UTC: I measured, P predicted."""

_LONGEST_STEP_NS = round(1.5 * gpstime.NS_PER_DAY)


_MOST_UT1_S = 0.01
"""Days have never been longer or shorter by more than 5 ms since they are measured so."""

_MOST_POLE_RAD = 0.02 * _ARCSEC_RAD
"""The pole goes by some 3 mas a day."""


@dataclass(frozen=True, slots=True, eq=False)
class Orientation:
    """The Earth's pole and angle, daily.

    t_ns          (n,) GPS time [ns], ascending
    ut1_gps_s     (n,) UT1 - GPS, which does not jump at leap seconds [s]
    pole_rad      (n, 2) x and y of the pole in terrestrial axes
    origin        the file's name, for errors
    measured_ns   GPS time of the last day whose UT1 is measured, not predicted; None where all are
    """

    t_ns: I64
    ut1_gps_s: F64
    pole_rad: F64
    origin: str
    measured_ns: int | None = None

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
        first, last = np.searchsorted(self.t_ns, (begin_ns, end_ns), "right") - 1
        steps = np.diff(self.t_ns[first : last + 2])
        if len(steps) and steps.max() > _LONGEST_STEP_NS:
            gap = first + int(np.argmax(steps))
            before, after = (gpstime.iso(int(self.t_ns[k]))[:10] for k in (gap, gap + 1))
            raise FileError(f"{self.origin}: no day between {before} and {after}, in which the run is")
        self._check_steps(slice(max(int(first) - 1, 0), int(last) + 3))

    def _check_steps(self, days: slice) -> None:
        """FileError where the Earth moves from one day to the next as it never does: zeros may stand for
        none."""
        t_ns = self.t_ns[days]
        length = np.diff(t_ns) / gpstime.NS_PER_DAY
        for name, steps, most, unit in (
            ("UT1", np.abs(np.diff(self.ut1_gps_s[days])), _MOST_UT1_S, "s"),
            ("the pole", np.abs(np.diff(self.pole_rad[days], axis=0)).max(axis=1), _MOST_POLE_RAD, "rad"),
        ):
            odd = np.flatnonzero(steps > most * length)
            if len(odd):
                day = gpstime.iso(int(t_ns[odd[0] + 1]))[:10]
                raise FileError(
                    f"{self.origin}: to {day} {name} moves by {steps[odd[0]]:.2g} {unit}; it never does by "
                    f"more than {most:.1g} {unit} a day: does a value stand for none?"
                )


def read(path: Path) -> Orientation:
    """The orientation of a file, gzip or plain, up to its first day without one; FileError in one line."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> Orientation:
    """The orientation in the text of a file; `origin` names it in errors."""
    rows, measured_mjd = [], np.inf
    for n, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        if not line[_FIELDS[-1][1] - 1 : _FIELDS[-1][2]].strip():
            break
        rows.append([_number(line, *field, f"{origin}: line {n}") for field in _FIELDS])
        if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
            raise FileError(f"{origin}: line {n}: MJD is {rows[-1][0]:g}, after {rows[-2][0]:g}")
        if line[_PREDICTED] == "P":
            measured_mjd = min(measured_mjd, rows[-1][0] - 1)
    table = np.reshape(rows, (-1, len(_FIELDS)))
    # Before GPS time began there are no leap seconds of it.
    mjd, x, y, ut1_utc_s = table[table[:, 0] >= _GPS_EPOCH_MJD].T
    if len(mjd) < 2:
        raise FileError(f"{origin}: {len(mjd)} days with UT1-UTC since 1980-01-06; two at least are needed")
    t_ns = np.array([gpstime.from_utc(_MJD_EPOCH + timedelta(days=float(day))) for day in mjd])
    leap_s = np.array([gpstime.leap_seconds(int(t)) for t in t_ns])
    measured_ns = None
    if np.isfinite(measured_mjd):
        measured_ns = gpstime.from_utc(_MJD_EPOCH + timedelta(days=measured_mjd))
    pole_rad = _ARCSEC_RAD * np.stack((x, y), axis=1)
    return Orientation(t_ns, ut1_utc_s - leap_s, pole_rad, origin, measured_ns)


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
