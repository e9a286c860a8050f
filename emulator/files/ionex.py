"""IONEX files: maps of vertical electron content as plain arrays.

Strict: what does not fit the format is refused with file, line and field. Maps of errors and of heights are
passed over, and so are the differential code biases in the header. Epochs are Universal Time.
Source: S. Schaer, W. Gurtner, J. Feltens, IONEX: The IONosphere Map EXchange Format Version 1 (1998), annex A
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TypeVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.files.text import FileError, read_text

NO_VALUE = 9999
DEFAULT_EXPONENT = -1
_LEAST_TECU, _MOST_TECU = -10.0, 1000.0
"""Content beyond is none: maps dip below zero by fractions, and the strongest storms made 300."""

_A_LINE, _WIDTH = 16, 5
_STEP = 1e-3
"""Grids are written to 0.1 deg."""
_MOST = 5000
"""Nodes of a grid, more than any producer has; keeps a damaged header from filling the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class TecMaps:
    """Two-dimensional maps of a file, in its order.

    epoch       (m,) calendar instants, UT
    lat_deg     (i,) geocentric;  lon_deg (j,) as the file has them, both ends of a full circle included
    vtec_tecu   (m, i, j) [TECU], nan where there is no value
    height_km   of the shell the maps belong to;  base_radius_km of the sphere below it
    """

    epoch: tuple[datetime, ...]
    lat_deg: F64
    lon_deg: F64
    vtec_tecu: F64
    height_km: float
    base_radius_km: float


N = TypeVar("N", int, float)

_Head = dict[str, tuple[str, int]]
"""Label -> columns 1 to 60 and line number."""


class _Reader:
    """The lines of a file, one after the other; reports their faults."""

    def __init__(self, text: str, origin: str):
        self.lines, self.origin, self.n = text.splitlines(), origin, 0

    def next(self, where: str) -> str:
        if self.n == len(self.lines):
            raise FileError(f"{self.origin}: line {self.n}: file ends inside {where}")
        self.n += 1
        return self.lines[self.n - 1]

    def fault(self, what: str, line: int | None = None) -> FileError:
        return FileError(f"{self.origin}: line {line or self.n}: {what}")

    def number(self, cell: str, field: str, kind: Callable[[str], N] = float, line: int | None = None) -> N:
        try:
            value = kind(cell)
        except ValueError:
            value = None
        if value is None or not np.isfinite(value) or "_" in cell:
            noun = "a whole number" if kind is int else "a number"
            raise self.fault(f"{field} is {cell.strip()!r}, not {noun}", line)
        return value

    def epoch(self, line: str, field: str) -> datetime:
        cells = [self.number(line[k : k + 6], field, int) for k in range(0, 36, 6)]
        # Some producers write the end of a day as 24 h.
        day, whole_day = cells[3] == 24, timedelta(days=1)
        try:
            year, month, of_month, hour, minute, second = cells
            moment = datetime(year, month, of_month, 0 if day else hour, minute, second)
        except ValueError as error:
            raise self.fault(f"{field} is {line[:36].strip()!r}: {error}") from None
        return moment + whole_day if day else moment


def read(path: Path) -> TecMaps:
    """The maps of an IONEX file, gzip or plain; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> TecMaps:
    """The maps in the text of a file; `origin` names it in errors."""
    reader = _Reader(text, origin)
    head = _header(reader)
    heights = _grid(reader, head, "HGT1 / HGT2 / DHGT")
    lat, lon = (_grid(reader, head, f"{name}1 / {name}2 / D{name}") for name in ("LAT", "LON"))
    if _of_head(reader, head, "MAP DIMENSION", int) != 2 or len(heights) != 1:
        raise FileError(f"{origin}: MAP DIMENSION is not 2: maps of one height are read")
    exponent = _of_head(reader, head, "EXPONENT", int) if "EXPONENT" in head else DEFAULT_EXPONENT
    epochs, maps = [], []
    while (label := _next_map(reader)) is not None:
        if label == "TEC":
            epoch, values = _map(reader, lat, len(lon), exponent)
            epochs.append(epoch)
            maps.append(values)
        else:
            while not reader.next(f"a map ({label})")[60:].upper().startswith(f"END OF {label} MAP"):
                pass
    stated = _of_head(reader, head, "# OF MAPS IN FILE", int)
    if not maps or len(maps) != stated:
        raise FileError(
            f"{origin}: line {reader.n}: {len(maps)} maps of content; # OF MAPS IN FILE is {stated}"
        )
    radius = _of_head(reader, head, "BASE RADIUS", float)
    return TecMaps(tuple(epochs), lat, lon, np.array(maps), float(heights[0]), radius)


def _header(reader: _Reader) -> _Head:
    first = reader.next("the header")
    if not first[60:].upper().startswith("IONEX VERSION / TYPE"):
        raise reader.fault("not an IONEX file (no IONEX VERSION / TYPE in columns 61-80)")
    version = reader.number(first[:8], "IONEX VERSION / TYPE")
    if not 1 <= version < 2 or first[20:21] != "I":
        raise reader.fault(f"IONEX version and type are {version:g} and {first[20:21]!r}; 1 and 'I' are read")
    head: _Head = {}
    while not (line := reader.next("the header"))[60:].upper().startswith("END OF HEADER"):
        head[line[60:].strip().upper()] = (line[:60], reader.n)
    return head


def _of_head(reader: _Reader, head: _Head, label: str, kind: type):
    """The one number of a line of the header."""
    cells, line = _needed(reader, head, label)
    return reader.number(cells[:8], label, kind, line)


def _needed(reader: _Reader, head: _Head, label: str) -> tuple[str, int]:
    if label not in head:
        raise FileError(f"{reader.origin}: header has no {label}")
    return head[label]


def _grid(reader: _Reader, head: _Head, label: str) -> F64:
    """Nodes from first, last and step; step 0 is a single one."""
    cells, line = _needed(reader, head, label)
    first, last, step = (reader.number(cells[k : k + 6], label, line=line) for k in (2, 8, 14))
    if step == 0 and first == last:
        return np.array([first])
    count = round((last - first) / step) if step else 0
    if not 0 < count < _MOST or abs(first + count * step - last) > _STEP:
        raise reader.fault(f"{label} is {' / '.join(cells.split())}: not a grid", line)
    return np.asarray(first + step * np.arange(count + 1), np.float64)


def _next_map(reader: _Reader) -> str | None:
    """Kind of the next map; None at the end of the file, whose last line some producers leave out."""
    while reader.n < len(reader.lines):
        label = reader.next("the file")[60:].strip().upper()
        if label.startswith("START OF ") and label.endswith(" MAP"):
            return label.removeprefix("START OF ").removesuffix(" MAP")
        if label == "END OF FILE":
            return None
        if reader.lines[reader.n - 1].strip():
            raise reader.fault("expected START OF a map or END OF FILE")
    return None


def _map(reader: _Reader, lat: F64, columns: int, exponent: int):
    """Epoch and values (i, j) of a map; a map may set an exponent of its own."""
    where, epoch, rows = "a map of content", None, []
    while not (line := reader.next(where))[60:].upper().startswith("END OF TEC MAP"):
        label = line[60:].strip().upper()
        if label == "EPOCH OF CURRENT MAP":
            epoch = reader.epoch(line, label)
        elif label == "EXPONENT":
            exponent = reader.number(line[:6], label, int)
        elif label == "LAT/LON1/LON2/DLON/H":
            place = reader.number(line[2:8], "LAT")
            if len(rows) == len(lat) or abs(place - lat[len(rows)]) > _STEP:
                expected = f"{lat[len(rows)]:g}" if len(rows) < len(lat) else "the end of the map"
                raise reader.fault(f"LAT is {place:g}; by the header {expected} follows")
            rows.append(_row(reader, columns))
        else:
            raise reader.fault(f"{line.strip()!r} is not part of a map")
    if epoch is None or len(rows) != len(lat):
        raise reader.fault(f"map has {len(rows)} of {len(lat)} latitudes" if epoch else "map has no epoch")
    values = np.array(rows, float)
    content = np.where(values == NO_VALUE, np.nan, values * 10.0**exponent)
    odd = np.argwhere((content < _LEAST_TECU) | (content > _MOST_TECU))
    if len(odd):
        i, j = odd[0]
        raise reader.fault(
            f"map of {epoch:%Y-%m-%dT%H:%M} has {content[i, j]:g} TECU in its row {i + 1}; allowed is "
            f"{_LEAST_TECU:g} to {_MOST_TECU:g}, and {NO_VALUE} where there is none"
        )
    return epoch, content


def _row(reader: _Reader, columns: int) -> list[int]:
    """Values of one latitude, sixteen a line."""
    values: list[int] = []
    while len(values) < columns:
        line = reader.next("a map of content")
        count = min(_A_LINE, columns - len(values))
        cells = [line[k : k + _WIDTH] for k in range(0, count * _WIDTH, _WIDTH)]
        try:
            values += map(int, cells)
        except ValueError:
            values += [reader.number(cell, "TEC", int) for cell in cells]
    return values
