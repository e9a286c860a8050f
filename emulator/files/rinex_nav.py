"""RINEX navigation files: GPS and GLONASS records of versions 2, 3 and 4 as plain arrays.

Strict: what does not fit the format is refused with file, line and field. Other systems' records of a
mixed file are passed over. Nothing is computed here; `gps` and `glonass` know what the numbers mean.
Sources: RINEX 2.11 (Gurtner & Estey, 2007), tables A3, A4, A10, A11; RINEX 3.05 (IGS/RTCM, 2020), appendix A;
RINEX 4.01 (IGS/RTCM, 2023), 5.4 and appendix A
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from datetime import datetime
from itertools import repeat
from math import isfinite, nan
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.emulator.files.rinex_blocks import blocks
from gnss_hil.emulator.files.rinex_layouts import LAYOUTS, MAY_BE_BLANK, UNKNOWN, UPLOADED, Layout
from gnss_hil.emulator.files.text import FileError, read_text

_VERSION_2_TYPES = {"N": "G", "G": "R"}

# A field is a Fortran D19.12: the exponent's letter may be D, d, E or e, and is lost where the exponent
# takes three digits.
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[DdEe]?([+-]\d+)|[DdEe](\d+))?\s*")


_Record = tuple[int, datetime, list[float]]
"""Satellite number, epoch and values of one record."""


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Records of one system in file order.

    number   (m,) PRN or slot
    epoch    (m,) calendar instant of the record: GPS time for GPS, UTC for GLONASS
    fields   name -> (m,) value, as written
    """

    number: I64
    epoch: tuple[datetime, ...]
    fields: dict[str, F64]

    def __len__(self) -> int:
        return len(self.number)


@dataclass(frozen=True, slots=True, eq=False)
class NavigationFile:
    """
    records             by RINEX letter
    glonass_to_utc_s    the file's -tau_c, 0 where it has none [s]
    placeless           RINEX letter -> records left out: what says place and clock is zero or unknown
    """

    records: dict[str, Records]
    glonass_to_utc_s: float
    placeless: dict[str, int]


def read(path: Path) -> NavigationFile:
    """The records of a RINEX navigation file, gzip or plain; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> NavigationFile:
    """The records in the text of a file; `origin` names it in errors."""
    lines = text.splitlines()
    version, kind = _version(lines[0], origin)
    end = next((n for n, line in enumerate(lines) if _is_labelled(line, "END OF HEADER")), None)
    if end is None:
        raise FileError(f"{origin}: line {len(lines)}: file ends inside the header")
    to_utc_s = _glonass_to_utc_s(lines[:end], origin)
    found: dict[str, list[_Record]] = {}
    placeless: Counter[str] = Counter()
    for block in blocks(lines, end + 1, version, origin):
        letter = kind or block.letter
        if block.kind == "EPH" and letter in LAYOUTS and block.message in ("", LAYOUTS[letter].message):
            end = _without_blank_lines(lines, block.first, block.end, max(LAYOUTS[letter].lines))
            record = _record(lines, block.first, end, LAYOUTS[letter], version, origin)
            if record is None:
                placeless[letter] += 1
            else:
                found.setdefault(letter, []).append(record)
        elif block.kind == "STO" and lines[block.first][24:28] == "GLUT":
            # Its second line: time of transmission, then the offset, -tau_c as in version 3.
            to_utc_s = _number(lines[block.end - 1][23:42], "GLUT", block.end, origin)
    records = {letter: _columns(rows, LAYOUTS[letter]) for letter, rows in found.items()}
    return NavigationFile(records, to_utc_s, dict(placeless))


def rivals(records: Records) -> list[int]:
    """Satellites, by number, that have records of one epoch and transmission that say different things."""
    sent = next((records.fields[name] for name in UPLOADED if name in records.fields), np.zeros(len(records)))
    sent, values = np.nan_to_num(sent, nan=-1.0), np.stack(list(records.fields.values()), axis=1)
    first: dict[tuple[int, datetime, float], int] = {}
    found: set[int] = set()
    for row, key in enumerate(zip(records.number.tolist(), records.epoch, sent.tolist(), strict=True)):
        before = values[first.setdefault(key, row)]
        if not np.allclose(before, values[row], rtol=_ROUNDING, atol=0, equal_nan=True):
            found.add(key[0])
    return sorted(found)


_ROUNDING = 1e-9
"""Programs write twelve digits, some fewer."""


def _columns(rows: list[_Record], layout: Layout) -> Records:
    numbers, epochs, values = zip(*rows, strict=True)
    return Records(
        np.array(numbers),
        epochs,
        dict(zip((*layout.fields, *layout.more), np.array(values).T.copy(), strict=True)),
    )


def _is_labelled(line: str, label: str) -> bool:
    """Whether a line of the header has a label in its columns 61 to 80, in letters of either size."""
    return line[60:].upper().startswith(label)


def _version(line: str, origin: str) -> tuple[float, str]:
    """Version, and the system's letter of a version 2 file, "" of a later one."""
    if not _is_labelled(line, "RINEX VERSION / TYPE"):
        raise FileError(f"{origin}: line 1: not a RINEX file (no RINEX VERSION / TYPE in columns 61-80)")
    try:
        version = float(line[:9])
    except ValueError:
        raise FileError(f"{origin}: line 1: RINEX version is {line[:9].strip()!r}, not a number") from None
    kind = line[20:21].upper()
    if not 2 <= version < 5:
        raise FileError(f"{origin}: line 1: RINEX version is {version:.2f}; 2, 3 and 4 are read")
    allowed = _VERSION_2_TYPES if version < 3 else {"N": ""}
    if kind not in allowed:
        found, wanted = line[20:40].strip(), " or ".join(allowed)
        raise FileError(f"{origin}: line 1: file type is '{found}'; navigation data is {wanted}")
    return version, allowed[kind]


def _glonass_to_utc_s(header: list[str], origin: str) -> float:
    """-tau_c [s], from CORR TO SYSTEM TIME (version 2) or GLUT of TIME SYSTEM CORR (version 3)."""
    for n, line in enumerate(header, 1):
        if _is_labelled(line, "CORR TO SYSTEM TIME"):
            return _number(line[21:40], "CORR TO SYSTEM TIME", n, origin)
        if line.startswith("GLUT") and _is_labelled(line, "TIME SYSTEM CORR"):
            return _number(line[5:22], "GLUT", n, origin)
    return 0.0


def _record(
    lines: list[str], first: int, end: int, layout: Layout, version: float, origin: str
) -> _Record | None:
    """One record, its values checked; None if it does not say where its satellite is, and its clock."""
    if end - first not in layout.lines:
        allowed = " or ".join(map(str, layout.lines))
        record = f"{layout.name} record from line {first + 1}"
        raise FileError(
            f"{origin}: line {end}: {record} has {so_many(end - first, 'line')}; it needs {allowed}"
        )
    head = lines[first]
    # Version 3 writes one column more everywhere: the letter, and a year of four digits.
    clock, data = (22, 3) if version < 3 else (23, 4)
    try:
        number = int(head[:2] if version < 3 else head[1:3])
        epoch = _epoch(head[2:clock] if version < 3 else head[3:clock])
    except ValueError:
        found = head[:clock].strip()
        raise FileError(f"{origin}: line {first + 1}: {found!r} is not a satellite and an epoch") from None
    if not 0 < number < 64:
        raise FileError(f"{origin}: line {first + 1}: satellite number is {number}; allowed is 1 to 63")
    texts = [head[c : c + 19] for c in (clock, clock + 19, clock + 38)]
    for line in lines[first + 1 : end]:
        texts += [line[c : c + 19] for c in (data, data + 19, data + 38, data + 57)]
    values = _values(texts, layout, first, origin)
    if _is_placeless(values, layout):
        return None
    for position in layout.may_be_blank:
        if values[position] >= UNKNOWN:
            values[position] = nan if layout.fields[position] in UPLOADED else 0.0
    values += _more(texts, layout, first, origin)
    names = (*layout.fields, *layout.more)
    for name in layout.bytes:
        position = names.index(name)
        values[position] -= 256 * (128 <= values[position] <= 255)
    for name, (least, greatest) in layout.ranges.items():
        position = names.index(name)
        if not least <= values[position] <= greatest:
            line = _line_of(first, position)
            allowed = f"allowed is {least} to {greatest}"
            raise FileError(f"{origin}: line {line}: {name} is {values[position]:g}; {allowed}")
    return number, epoch, values


def _without_blank_lines(lines: list[str], first: int, end: int, most: int) -> int:
    """End of a record without blank lines behind it; those that it may have are its own."""
    while end - first > most and not lines[end - 1].strip():
        end -= 1
    return end


def _is_placeless(values: list[float], layout: Layout) -> bool:
    """Whether a record says nothing of where its satellite is: zeros are no place, and unknown is nothing."""
    if not any(values[layout.fields.index(name)] for name in layout.place):
        return True
    said = (values[layout.fields.index(name)] for name in layout.ranges if name in layout.fields)
    return any(UNKNOWN <= value < _BEYOND_UNKNOWN for value in said)


_BEYOND_UNKNOWN = 1e9
"""What is larger is damage."""


_YEARS = 1980, 2200


def _epoch(text: str) -> datetime:
    *date, seconds = text.split()
    year, month, day, hour, minute = map(int, date)
    if year < 100:
        year += 1900 if year >= 80 else 2000
    if not _YEARS[0] <= year <= _YEARS[1]:
        raise ValueError(text)
    moment = datetime(year, month, day, hour, minute)
    return moment.replace(second=int(float(seconds)))


def _values(texts: list[str], layout: Layout, first: int, origin: str) -> list[float]:
    names = layout.fields
    try:
        values = list(map(float, map(str.replace, texts[: len(names)], repeat("D"), repeat("E"))))
        # Python, unlike Fortran, reads digits grouped by underscores.
        if len(values) == len(names) and all(map(isfinite, values)) and "_" not in "".join(texts):
            return values
    except ValueError:
        pass
    padded = texts + [""] * (len(names) - len(texts))
    return [
        _number(text, name, _line_of(first, k), origin)
        for k, (name, text) in enumerate(zip(names, padded, strict=False))
    ]


def _more(texts: list[str], layout: Layout, first: int, origin: str) -> list[float]:
    """Values of the line that not every record has."""
    begin = len(layout.fields)
    found = texts[begin : begin + len(layout.more)]
    values = [
        _number(text, name, _line_of(first, begin + k), origin)
        for k, (name, text) in enumerate(zip(layout.more, found, strict=False))
    ]
    values += [0.0] * (len(layout.more) - len(found))
    return [0.0 if value >= UNKNOWN else value for value in values]


def _line_of(first: int, position: int) -> int:
    """Line, 1-based, of a record's field: three on the first line, then four a line."""
    return first + 1 + (position + 1) // 4


def _number(text: str, name: str, line: int, origin: str) -> float:
    """One field the slow way: blanks, odd exponents, or the error."""
    if not text.strip() and name in MAY_BE_BLANK:
        return nan if name in UPLOADED else 0.0
    match = _NUMBER.fullmatch(text)
    value = float(f"{match[1]}e{match[2] or match[3] or 0}") if match else nan
    if not isfinite(value):
        raise FileError(f"{origin}: line {line}: {name} is {text.strip()!r}, not a number")
    return value
