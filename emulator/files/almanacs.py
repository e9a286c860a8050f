"""Almanacs as they are published: YUMA, SEM, and bulletins of GLONASS (.agl). Recognised by content.

Every record is some lines of numbers in a fixed order; one table for each kind has it. GPS weeks are
written modulo 1024, so that a date nearby is needed to know which is meant.
Sources: YUMA: celestrak.org, Definition of a Yuma Almanac; SEM: ICD-GPS-870, table 30-III (inclination less
0.3 semicircles); AGL: the three lines as a receiver maker describes them (Information and Analysis Centre of
GLONASS publishes such files), angles in semicircles and names of ICD GLONASS 5.1, 4.5
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.files.text import FileError, read_text

WEEKS = 1024
"""Weeks are written modulo this; larger numbers are whole."""

SEM_INCLINATION_RAD = 0.3 * np.pi
"""Inclinations of SEM files are counted from it."""

MOSCOW_H = 3
"""GLONASS days begin so much before those of UTC."""


@dataclass(frozen=True, slots=True, eq=False)
class Almanac:
    """Satellites of one system, each once, by number.

    system        of `gnss_hil.dbc.common.satellites`
    number        (n,) PRN or slot
    healthy       (n,) bool, as the almanac has it
    reference_ns  (n,) GPS time its elements belong to: of applicability, or of the ascending node [ns]
    elements      name -> (n,). GPS: e, i0, omega0, omega_dot, sqrt_a, omega, m0 as `world.gps.orbit` takes
                  them. GLONASS: longitude, delta_i, omega [rad], e, delta_t [s], delta_t_dot [s per orbit^2]
    """

    system: int
    number: I64
    healthy: Bool
    reference_ns: I64
    elements: dict[str, F64]


@dataclass(frozen=True, slots=True)
class _Field:
    """A number: what the file calls it, the values allowed, whether only whole ones are."""

    name: str
    low: float
    high: float
    whole: bool = False


_TURN = 2 * np.pi + 1e-6
_PRN, _HEALTH = _Field("ID", 1, 63, True), _Field("Health", 0, 255, True)
_E, _ROOT = _Field("Eccentricity", 0, 0.1), _Field("SQRT(A)", 4000, 7000)
_AF0, _AF1 = _Field("Af0", -1, 1), _Field("Af1", -1, 1)
_WEEK, _TOA = _Field("week", 0, 10_000, True), _Field("Time of Applicability", 0, gpstime.S_PER_WEEK)

_YUMA = (
    _PRN, _HEALTH, _E, _TOA, _Field("Orbital Inclination", 0, np.pi),
    _Field("Rate of Right Ascen", -1e-6, 1e-6), _ROOT, _Field("Right Ascen at Week", -_TURN, _TURN),
    _Field("Argument of Perigee", -_TURN, _TURN), _Field("Mean Anom", -_TURN, _TURN), _AF0, _AF1, _WEEK,
)  # fmt: skip

_SEM_HEAD = (_WEEK, _TOA)
_SEM = (
    (_PRN,),
    (_Field("SVN", 0, 999, True),),
    (_Field("URA", 0, 15, True),),
    (_E, _Field("Inclination Offset", -0.3, 0.7), _Field("Rate of Right Ascension", -1e-6, 1e-6)),
    (_ROOT, _Field("Longitude of Orbital Plane", -2, 2), _Field("Argument of Perigee", -2, 2)),
    (_Field("Mean Anomaly", -2, 2), _AF0, _AF1),
    (_HEALTH,),
    (_Field("Configuration", 0, 15, True),),
)

_DATE = (_Field("day", 1, 31, True), _Field("month", 1, 12, True), _Field("year", 1982, 2100, True))
_AGL = (
    (*_DATE, _Field("time of receipt", 0, 90_000)),
    (
        _Field("slot", 1, 63, True), _Field("frequency number", -7, 20, True), _Field("health", 0, 1, True),
        *_DATE, _Field("time of the ascending node", 0, 86_400), _Field("correction to UTC", -1, 1),
        _Field("correction to GPS", -1, 1), _Field("correction of the satellite's clock", -1, 1),
    ),
    (
        _Field("longitude of the node", -1, 1), _Field("correction of the inclination", -0.1, 0.1),
        _Field("argument of perigee", -1, 1), _Field("eccentricity", 0, 0.1),
        _Field("correction of the period", -4000, 4000), _Field("rate of the period", -0.1, 0.1),
    ),
)  # fmt: skip

_GPS_ELEMENTS = ("e", "i0", "omega_dot", "sqrt_a", "omega0", "omega", "m0")


def read(path: Path, near_ns: int) -> Almanac:
    """The almanac in a file, weeks of GPS chosen to be nearest to near_ns; FileError with one line."""
    return parse(read_text(Path(path)), str(path), near_ns)


def parse(text: str, origin: str, near_ns: int) -> Almanac:
    """The almanac in the text of a file; `origin` names it in errors.

    Of several records of a satellite that nearest to near_ns stands, of equal ones the last.
    """
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    first = lines[0][1].split()
    if first[0].startswith("***"):
        return _gps(_yuma_rows(lines, origin), near_ns)
    if len(first) <= 2 and first[0].isdigit():
        return _gps(_sem_rows(lines, origin), near_ns)
    if len(first) >= 4 and first[0].isdigit():
        return _glonass(lines, origin, near_ns)
    raise FileError(f"{origin}: line {lines[0][0]}: begins with {first[0]!r}; not YUMA, SEM, or AGL")


def _value(cell: str, field: _Field, n: int, origin: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not field.low <= value <= field.high or (field.whole and value % 1):
        kind = "a whole number" if field.whole else "a number"
        raise FileError(
            f"{origin}: line {n}: {field.name} is {cell!r}; {kind} from {field.low:g} to {field.high:g}"
        )
    return value


def _values(line: tuple[int, str], fields: Sequence[_Field], origin: str, more: bool = False) -> list[float]:
    """Numbers of a line; `more`: words after them are a comment."""
    n, text = line
    cells = text.split()
    if len(cells) < len(fields):
        raise FileError(f"{origin}: line {n}: {fields[len(cells)].name} is missing; {len(fields)} numbers")
    if len(cells) > len(fields) and not more:
        raise FileError(f"{origin}: line {n}: {cells[len(fields)]!r} after {fields[-1].name}, the last")
    return [_value(cell, field, n, origin) for cell, field in zip(cells, fields, strict=False)]


def _blocks(lines: list, size: int, unit: str, origin: str) -> Iterator[list[tuple[int, str]]]:
    for at in range(0, len(lines), size):
        block = lines[at : at + size]
        if len(block) < size:
            raise FileError(f"{origin}: line {block[-1][0]}: file ends in {unit}; {size} lines each")
        yield block


def _yuma_rows(lines: list, origin: str) -> Iterator[tuple[list[float], int, float, int, int]]:
    """For each satellite its elements, week, second of week, PRN, health."""
    for block in _blocks(lines, 1 + len(_YUMA), "a satellite's record", origin):
        n, head = block[0]
        if not head.startswith("***"):
            raise FileError(f"{origin}: line {n}: {head.strip()[:20]!r} instead of a satellite's heading ***")
        row = []
        for (n, line), field in zip(block[1:], _YUMA, strict=True):
            label, _, cell = line.partition(":")
            if not label.strip().lower().startswith(field.name.lower()):
                raise FileError(f"{origin}: line {n}: {field.name} is missing; the line is {line[:30]!r}")
            row.append(_value(cell.strip(), field, n, origin))
        number, health, e, toa_s, i0, omega_dot, sqrt_a, omega0, omega, m0, _, _, week = row
        yield [e, i0, omega_dot, sqrt_a, omega0, omega, m0], int(week), toa_s, int(number), int(health)


def _sem_rows(lines: list, origin: str) -> Iterator[tuple[list[float], int, float, int, int]]:
    """As `_yuma_rows`."""
    n, head = lines[0]
    count = int(_value(head.split()[0], _Field("number of records", 1, 63, True), n, origin))
    if len(lines) < 2:
        raise FileError(f"{origin}: line {n}: {_WEEK.name} is missing; the file ends")
    week, toa_s = _values(lines[1], _SEM_HEAD, origin)
    blocks = list(_blocks(lines[2:], len(_SEM), "a satellite's record", origin))
    if len(blocks) != count:
        raise FileError(f"{origin}: line {n}: number of records is {count}; the file has {len(blocks)}")
    for block in blocks:
        (number,), _, _, (e, offset, rate), (sqrt_a, omega0, omega), (m0, _, _), (health,), _ = (
            _values(line, fields, origin) for line, fields in zip(block, _SEM, strict=True)
        )
        i0 = SEM_INCLINATION_RAD + np.pi * offset
        angles = [np.pi * semicircles for semicircles in (omega0, omega, m0)]
        yield [e, i0, np.pi * rate, sqrt_a, *angles], int(week), toa_s, int(number), int(health)


def nearest_of_each(number: I64, away_ns: I64) -> I64:
    """Rows to keep, by number: of each number (m,) that which is least away (m,), of equal ones the last."""
    order = np.lexsort((-np.arange(len(number)), away_ns, number))
    return order[np.unique(number[order], return_index=True)[1]]


def _gps(rows: Iterator[tuple[list[float], int, float, int, int]], near_ns: int) -> Almanac:
    elements, weeks, toas_s, numbers, health = zip(*rows, strict=True)
    number = np.array(numbers)
    references_ns = [reference_ns(week, toa_s, near_ns) for week, toa_s in zip(weeks, toas_s, strict=True)]
    keep = nearest_of_each(number, np.abs(np.array(references_ns) - near_ns))
    return Almanac(
        satellites.GPS,
        number[keep],
        np.array(health)[keep] == 0,
        np.array(references_ns)[keep],
        dict(zip(_GPS_ELEMENTS, np.array(elements)[keep].T, strict=True)),
    )


def reference_ns(week: int, second: float, near_ns: int) -> int:
    """GPS time [ns] of a second of a week that may be written modulo 1024: the one nearest to near_ns."""
    t_ns = week * gpstime.NS_PER_WEEK + round(second * gpstime.NS_PER_S)
    if week >= WEEKS:
        return t_ns
    turn_ns = WEEKS * gpstime.NS_PER_WEEK
    return t_ns + (near_ns - t_ns + turn_ns // 2) // turn_ns * turn_ns


def _glonass(lines: list, origin: str, near_ns: int) -> Almanac:
    entries = [_entry(block, origin) for block in _blocks(lines, len(_AGL), "an entry", origin)]
    slots, nodes_ns, healthy, values = zip(*entries, strict=True)
    slot, node_ns = np.array(slots), np.array(nodes_ns)
    keep = nearest_of_each(slot, np.abs(node_ns - near_ns))
    longitude, delta_i, omega, e, delta_t, rate = np.array(values)[keep].T
    return Almanac(
        satellites.GLONASS,
        slot[keep],
        np.array(healthy)[keep],
        node_ns[keep],
        {
            "longitude": np.pi * longitude, "delta_i": np.pi * delta_i, "omega": np.pi * omega,
            "e": e, "delta_t": delta_t, "delta_t_dot": rate,
        },
    )  # fmt: skip


def _entry(block: list[tuple[int, str]], origin: str) -> tuple[int, int, bool, list[float]]:
    """Slot, GPS time of the ascending node [ns], health and elements of a bulletin's entry."""
    _values(block[0], _AGL[0], origin, more=True)
    slot, _, health, day, month, year, node_s, *_ = _values(block[1], _AGL[1], origin)
    try:
        midnight = datetime(int(year), int(month), int(day))
    except ValueError:
        raise FileError(
            f"{origin}: line {block[1][0]}: day is '{day:g}'; month {month:g} has none such"
        ) from None
    node_ns = gpstime.from_utc(midnight + timedelta(hours=-MOSCOW_H, seconds=node_s))
    return int(slot), node_ns, health == 1, _values(block[2], _AGL[2], origin)
