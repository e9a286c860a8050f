"""SP3 files, versions a, c and d: orbits and clocks of satellites on a grid of instants.

Strict: what does not fit the format is refused with file, line and field. Velocities, correlations and what
the header says of accuracy are passed over.
Source: S. Hilla, The Extended Standard Product 3 Orbit Format (SP3-c), 2010, and (SP3-d), 2016
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.files.columns import Lines, decimals, nothing_but_nines
from gnss_hil.emulator.files.text import FileError, read_text

_FIELD, _DECIMALS = 14, 6
"""Every number is F14.6: kilometres, microseconds."""

_ABSENT = 999_999.0
"""Clocks from here on, of either sign, are absent; files write 999999.999999, some 999999."""

_NINES = range(4, 7)
"""Nothing but so many nines are absent too, clocks, and positions of three such numbers."""

_EARTH_FIXED = ("IG", "IT", "WG", "PZ", "PE", "SLR", "ET", "UND", "GTR", "CGC")
"""How names of coordinate systems begin that turn with the Earth: IGS20, IGb14, ITRF, WGS84, PZ-90, ..."""

_INERTIAL = ("ECI", "EME", "J2000", "J20", "GCR", "ICR", "TEM", "TOD", "MOD", "CIR", "INE")
"""How names begin of those that do not."""

_NUMBERS = ("x", "y", "z", "clock")

_TICKS_PER_S = 100_000_000
"""Epochs are written to 10 ns."""


def _plus(seconds: int) -> Callable[[datetime], int]:
    return lambda moment: gpstime.from_calendar(moment) + seconds * gpstime.NS_PER_S


_SCALES: dict[str, Callable[[datetime], int]] = {
    **dict.fromkeys(("GPS", "GAL", "QZS", "IRN", "ccc"), gpstime.from_calendar),
    **dict.fromkeys(("UTC", "GLO"), gpstime.from_utc),
    "TAI": _plus(-19),
    "BDT": _plus(14),
}
"""Time system of the header -> GPS time of a calendar instant. SP3-d, line 13; SP3-a has ccc there."""


@dataclass(frozen=True, slots=True, eq=False)
class Sp3:
    """Centres of mass of satellites on a grid of instants.

    origin      the file, or the files
    t_ns        (t,) GPS time, ascending [ns]
    name        n satellites as SP3 names them: G07, R21; L09 for one in low orbit
    pos_ecef_m  (t, n, 3) in the file's terrestrial frame, an ITRF [m]; nan where absent
    clock_s     (t, n) satellite clock against GPS time, without its periodic relativity [s]; nan where absent
    frame       coordinate system as written, such as IGS20
    predicted   (t,) whether some position of an instant is predicted, not measured; None where none is
    breaks      what a flag says to have happened since the instant before: GPS time [ns], satellite, what;
                orbit or clock of that instant is absent, so that nothing is interpolated across it
    apart_m     how far the files of a joined product disagree at most where several have a position [m]
    """

    origin: str
    t_ns: I64
    name: tuple[str, ...]
    pos_ecef_m: F64
    clock_s: F64
    frame: str = ""
    predicted: Bool | None = None
    breaks: tuple[tuple[int, str, str], ...] = ()
    apart_m: float = 0.0

    @property
    def index(self) -> I64:
        """(k,) satellite index of the navigation satellites, ascending: no columns, see `navigation`."""
        return self.navigation()[0]

    def navigation(self) -> tuple[I64, I64]:
        """Satellite index (k,), ascending, and column (k,) of those with a letter of ours."""
        named = ((_index(name), column) for column, name in enumerate(self.name))
        found = {index: column for index, column in named if index is not None}
        index = np.array(sorted(found), np.int64)
        return index, np.array([found[k] for k in index.tolist()], np.int64)


def _index(name: str) -> int | None:
    try:
        return satellites.parse(name)
    except ValueError:
        return None


def read(path: Path) -> Sp3:
    """The satellites of an SP3 file, gzip or plain; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> Sp3:
    """The satellites in the text of a file; `origin` names it in errors."""
    lines = Lines(text, origin)
    scale = _SCALES[_time_scale(lines)]
    frame = _frame(lines)
    epoch_lines, t_ns, rows = [], [], []
    for n, line in enumerate(lines.text):
        if line.startswith("*"):
            epoch_lines.append(n)
            t_ns.append(_moment_ns(line, n, scale, origin))
            if len(t_ns) > 1 and t_ns[-1] <= t_ns[-2]:
                raise FileError(f"{origin}: line {n + 1}: epoch does not follow the one before it")
        elif line.startswith("P"):
            if not t_ns:
                raise FileError(f"{origin}: line {n + 1}: a position comes before the first epoch")
            rows.append((n, len(t_ns) - 1, _satellite(line, n, origin)))
        elif line.startswith("EOF"):
            return _gathered(lines, t_ns, rows, frame)
    raise FileError(f"{origin}: line {len(lines.text)}: file is cut off; its last line is not EOF")


def _gathered(lines: Lines, t_ns: list[int], rows: list[tuple[int, int, str]], frame: str) -> Sp3:
    if not rows:
        raise FileError(f"{lines.origin}: line {len(lines.text)}: the file has no position")
    at, epoch, names = (np.array(column) for column in zip(*rows, strict=True))
    name, column = np.unique(names, return_inverse=True)
    pair = epoch * len(name) + column
    order = np.argsort(pair, kind="stable")
    twice = np.flatnonzero(np.diff(pair[order]) == 0)
    if len(twice):
        line = int(at[order[twice[0] + 1]])
        raise FileError(f"{lines.origin}: line {line + 1}: the epoch has {lines.text[line][1:4]} already")
    pos_km, clock_us = _numbers(lines, at)
    grid = np.full((len(t_ns), len(name), 4), np.nan)
    absent = (pos_km == 0).all(axis=1) | nothing_but_nines(pos_km, _NINES, _DECIMALS).all(axis=1)
    grid[epoch, column, :3] = np.where(absent[:, None], np.nan, 1e3 * pos_km)
    grid[epoch, column, 3] = np.where(_no_clock(clock_us, column), np.nan, 1e-6 * clock_us)
    _check_distances(lines, at, pos_km, absent)
    predicted = np.zeros(len(t_ns), bool)
    predicted[epoch[_flagged(lines, at, *_PREDICTED)]] = True
    breaks = []
    for flag, items, what in _BREAKS:
        for row in np.flatnonzero(_flagged(lines, at, *flag)).tolist():
            grid[epoch[row], column[row], items] = np.nan
            breaks.append((t_ns[epoch[row]], str(names[row]), what))
    instants, names = np.array(t_ns), tuple(name.tolist())
    pos_m, clock_s = grid[..., :3], grid[..., 3]
    return Sp3(lines.origin, instants, names, pos_m, clock_s, frame, predicted, tuple(sorted(breaks)))


def _flagged(lines: Lines, at: I64, place: int, letter: str) -> Bool:
    """(p,) whether the lines `at` have a letter in a column."""
    return lines.field(at, place, 1)[:, 0] == ord(letter)


def _no_clock(clock_us: F64, column: I64) -> Bool:
    """(p,) whether clocks stand for none: nines, and exact zeros of satellites that have other values too."""
    absent = (np.abs(clock_us) >= _ABSENT) | nothing_but_nines(clock_us, _NINES, _DECIMALS)
    moving = np.unique(column[~absent & np.isfinite(clock_us) & (clock_us != 0)])
    return absent | ((clock_us == 0) & np.isin(column, moving))


_PREDICTED = 79, "P"
"""Column, from 0, and letter of a flag, here that an orbit is predicted. SP3-c, table 1."""

_BREAKS = (((78, "M"), slice(0, 3), "a manoeuvre"), ((74, "E"), slice(3, 4), "a jump of its clock"))
"""Flags of what happened since the instant before, which of a satellite's numbers do not go on then, in
words."""

_NEAREST_KM, _FARTHEST_KM = 6_200.0, 100_000.0
"""From the Earth's centre: satellites of navigation systems are well within."""


def _check_distances(lines: Lines, at: I64, pos_km: F64, absent: Bool) -> None:
    """FileError if a navigation satellite is where none can be: in other units, as a rule."""
    distance_km = np.linalg.norm(pos_km, axis=1)
    odd = ~absent & ((distance_km < _NEAREST_KM) | (distance_km > _FARTHEST_KM))
    for row in np.flatnonzero(odd).tolist():
        line = int(at[row])
        if _index(_satellite(lines.text[line], line, lines.origin)) is not None:
            raise FileError(
                f"{lines.origin}: line {line + 1}: {lines.text[line][1:4]} is {distance_km[row]:.6g} km from "
                f"the Earth's centre; allowed is {_NEAREST_KM:g} to {_FARTHEST_KM:g} km: is it in km?"
            )


def _frame(lines: Lines) -> str:
    """The coordinate system; FileError if it does not turn with the Earth."""
    written = lines.text[0][46:51].strip()
    if written.upper().startswith(_INERTIAL):
        raise FileError(
            f"{lines.origin}: line 1: coordinate system is '{written}'; one that turns with the Earth is read"
        )
    return written


def is_earth_fixed(frame: str) -> bool:
    """Whether the name of a coordinate system is one that is known to turn with the Earth."""
    return frame == "" or frame.upper().startswith(_EARTH_FIXED)


def _numbers(lines: Lines, at: I64) -> tuple[F64, F64]:
    """Positions (p, 3) [km] and clocks (p,) [us] of the lines `at`; a clock may be blank."""
    columns = []
    for k, name in enumerate(_NUMBERS):
        place = 4 + k * _FIELD
        values, bad = decimals(lines.field(at, place, _FIELD), _DECIMALS)
        bad |= np.isnan(values) if name != "clock" else False
        if bad.any():
            line = int(at[np.argmax(bad)])
            found = lines.text[line][place : place + _FIELD].strip()
            raise FileError(f"{lines.origin}: line {line + 1}: {name} is '{found}'; allowed is F14.6")
        columns.append(values)
    return np.stack(columns[:3], axis=1), columns[3]


def _time_scale(lines: Lines) -> str:
    first = lines.text[0]
    if first[:1] != "#" or first[1:2] not in ("a", "b", "c", "d") or first[2:3] not in ("P", "V"):
        raise FileError(f"{lines.origin}: line 1: not an SP3 file (it begins with #a, #c or #d and P or V)")
    for n, line in enumerate(lines.text):
        if line.startswith("%c"):
            if line[9:12].upper() in _SCALES:
                return line[9:12].upper()
            if line[9:12] not in _SCALES:
                known = ", ".join(scale for scale in _SCALES if scale != "ccc")
                where = f"{lines.origin}: line {n + 1}"
                raise FileError(f"{where}: time system is '{line[9:12]}'; allowed is {known}")
            return line[9:12]
        if line.startswith("*"):
            break
    raise FileError(f"{lines.origin}: line 1: the header has no %c line with the time system")


def _moment_ns(line: str, n: int, scale: Callable[[datetime], int], origin: str) -> int:
    try:
        *date, seconds = line[1:31].split()
        whole, _, rest = seconds.partition(".")
        ticks = int(whole) * _TICKS_PER_S + int(rest[:8].ljust(8, "0"))
        if len(date) != 5 or not 0 <= ticks < 60 * _TICKS_PER_S:
            raise ValueError(line)
        year, month, day, hour, minute = map(int, date)
        return scale(datetime(year, month, day, hour, minute)) + ticks * 10
    except ValueError:
        raise FileError(f"{origin}: line {n + 1}: epoch is '{line[1:31].strip()}'; no such moment") from None


def _satellite(line: str, n: int, origin: str) -> str:
    """Name of a satellite; SP3-a writes GPS numbers without a letter."""
    letter, number = line[1:2].replace(" ", "G").upper(), line[2:4].replace(" ", "0")
    if not (letter.isalpha() and letter.isupper() and len(number) == 2 and number.isdecimal()):
        raise FileError(f"{origin}: line {n + 1}: satellite is '{line[1:4]}'; allowed is such as G07")
    return letter + number


def joined(products: Sequence[Sp3]) -> Sp3:
    """Several products as one; where two have a satellite's position at an epoch, the later one counts."""
    t_ns = np.unique(np.concatenate([product.t_ns for product in products]))
    name = tuple(sorted({name for product in products for name in product.name}))
    pos, clock = np.full((len(t_ns), len(name), 3), np.nan), np.full((len(t_ns), len(name)), np.nan)
    predicted, apart_m = np.zeros(len(t_ns), bool), 0.0
    breaks = tuple(sorted({one for product in products for one in product.breaks}))
    for product in products:
        columns = np.array([name.index(one) for one in product.name], np.int64)
        at = np.ix_(np.searchsorted(t_ns, product.t_ns), columns)
        there = np.asarray(np.isfinite(product.pos_ecef_m).all(axis=2))
        off_m = np.nan_to_num(np.linalg.norm(product.pos_ecef_m - pos[at], axis=2))
        apart_m = max(apart_m, float(off_m.max(initial=0.0)))
        pos[at] = np.where(there[..., None], product.pos_ecef_m, pos[at])
        clock[at] = np.where(there, product.clock_s, clock[at])
        if product.predicted is not None:
            predicted[at[0].ravel()] = product.predicted
    frames = ", ".join(dict.fromkeys(filter(None, (product.frame for product in products))))
    origin = ", ".join(product.origin for product in products)
    return Sp3(origin, t_ns, name, pos, clock, frames, predicted, breaks, apart_m)
