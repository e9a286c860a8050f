"""Tables of flown states: comma-separated columns, named in the first line, by UTC.

Instants are written as ISO 8601 has them; an offset from UTC (Z, +03:00) counts.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from io import StringIO
from math import isfinite
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.files.text import FileError, read_text

TIME = "UTC"


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """t_ns (n,) GPS time [ns], ascending; columns (n, w) as wanted."""

    t_ns: I64
    columns: F64


def read(path: Path, wanted: Sequence[str]) -> Table:
    """The wanted columns of a table, gzip or plain; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), wanted, str(path))


def parse(text: str, wanted: Sequence[str], origin: str) -> Table:
    """The wanted columns in the text of a table; `origin` names it in errors."""
    lines = csv.reader(StringIO(text))
    head = [name.strip() for name in next((cells for cells in lines if _says_something(cells)), [])]
    column = {name.casefold(): place for place, name in reversed(list(enumerate(head)))}
    for name in (TIME, *wanted):
        if name.casefold() not in column:
            there = ", ".join(head)[:200]
            raise FileError(f"{origin}: line {lines.line_num}: column {name} is missing; there are {there}")
    time_at, places = column[TIME.casefold()], [column[name.casefold()] for name in wanted]
    times, rows = [], []
    for cells in lines:
        n = lines.line_num
        if not _says_something(cells):
            continue
        if len(cells) != len(head):
            raise FileError(f"{origin}: line {n}: {len(cells)} columns; the first line names {len(head)}")
        times.append(_time(cells[time_at], f"{origin}: line {n}"))
        rows.append([_number(cells[k], head[k], f"{origin}: line {n}") for k in places])
        if len(times) > 1 and times[-1] <= times[-2]:
            raise FileError(f"{origin}: line {n}: {TIME} does not ascend")
    if len(rows) < 2:
        raise FileError(f"{origin}: {len(rows)} rows; two at least are needed")
    return Table(np.array(times), np.array(rows))


def _says_something(cells: list[str]) -> bool:
    """Whether a line is neither blank nor a comment (#)."""
    return any(map(str.strip, cells)) and not cells[0].lstrip().startswith("#")


def _time(text: str, where: str) -> int:
    try:
        moment = datetime.fromisoformat(text.strip())
        return gpstime.from_utc(moment if moment.tzinfo is None else moment.astimezone(UTC))
    except (ValueError, OverflowError):
        raise FileError(f"{where}: {TIME} is {text!r}, not a date and time") from None


def _number(text: str, name: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise FileError(f"{where}: {name} is {text!r}, not a number") from None
    if not isfinite(value):
        raise FileError(f"{where}: {name} is {text!r}, not finite")
    return value
