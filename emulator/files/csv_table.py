"""Tables of flown states: comma-separated columns, named in the first line, by UTC.

Instants are written as ISO 8601 has them; an offset from UTC (Z, UTC, +03:00) counts. Columns may be
separated by semicolons or tabs as well, with a comma in numbers, and what follows a # is a comment.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from io import StringIO
from math import isfinite
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.counts import so_many
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
    text, separator = _bare(text)
    lines = csv.reader(StringIO(text), delimiter=separator)
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
        while len(cells) > len(head) and not cells[-1].strip():
            cells.pop()
        if len(cells) != len(head):
            raise FileError(f"{origin}: line {n}: {len(cells)} columns; the first line names {len(head)}")
        times.append(_time(cells[time_at], f"{origin}: line {n}"))
        if separator != ",":
            cells = [cell.replace(",", ".") for cell in cells]
        rows.append([_number(cells[k], head[k], f"{origin}: line {n}") for k in places])
        if len(times) > 1 and times[-1] <= times[-2]:
            raise FileError(f"{origin}: line {n}: {TIME} does not ascend")
    if len(rows) < 2:
        raise FileError(f"{origin}: {so_many(len(rows), 'row')}; two at least are needed")
    return Table(np.array(times), np.array(rows))


_COMMENT = re.compile(r"(^|[ \t])#[^\n\"]*$", re.MULTILINE)
_ANNOUNCED = re.compile(r"\s*\"?sep=(.)\"?[ ,;\t]*(?=\n)", re.IGNORECASE)


def _bare(text: str) -> tuple[str, str]:
    """A table's text without comments, as many lines, and what separates its columns: spreadsheets announce
    it in a first line, or it is what the line of names has."""
    text = _COMMENT.sub("", text)
    announced = _ANNOUNCED.match(text)
    if announced:
        return text[: announced.start(0)] + text[announced.end(0) :], announced[1]
    names = text.lstrip().partition("\n")[0]
    return text, next((sign for sign in ",;\t" if sign in names), ",")


def _says_something(cells: list[str]) -> bool:
    """Whether a line is not blank."""
    return any(map(str.strip, cells))


def _time(text: str, where: str) -> int:
    try:
        written = _NAMED_UTC.sub("+00:00", text.strip())
        leap = _LEAP.fullmatch(written)
        # A leap second, 23:59:60, is the one after 23:59:59.
        moment = datetime.fromisoformat(f"{leap[1]}59{leap[2]}" if leap else written)
        t_ns = gpstime.from_utc(moment if moment.tzinfo is None else moment.astimezone(UTC))
        return t_ns + (gpstime.NS_PER_S if leap else 0)
    except (ValueError, OverflowError):
        raise FileError(f"{where}: {TIME} is {text!r}, not a date and time") from None


_NAMED_UTC = re.compile(r"[ \t]*(UTC|GMT)$", re.IGNORECASE)
_LEAP = re.compile(r"(.*[T ]\d\d:\d\d:)60(.*)")


def _number(text: str, name: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise FileError(f"{where}: {name} is {text!r}, not a number") from None
    if not isfinite(value):
        raise FileError(f"{where}: {name} is {text!r}, not finite")
    return value
