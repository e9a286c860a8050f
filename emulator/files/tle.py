"""Two-line element sets: which object's, of which epoch, and whether the lines are whole.

Source: D. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., 2.4.2 (columns and checksum)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.files.text import FileError, read_text

_LENGTH = 69
_FIRST_YEAR = 57
"""Two-digit years from here on are of the 20th century: that of Sputnik."""


_PLAIN = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)\s*|\s*")
_POWER = re.compile(r"[ +-]?\s*\d{1,5}\s*[ +-]\d|\s*")
_DIGITS = re.compile(r"[\d ]{7}")
_FIELDS = {
    "1": (
        ("rate of mean motion", 33, 43, _PLAIN), ("second rate", 44, 52, _POWER),
        ("drag term", 53, 61, _POWER),
    ),
    "2": (
        ("inclination", 8, 16, _PLAIN), ("right ascension", 17, 25, _PLAIN),
        ("eccentricity", 26, 33, _DIGITS), ("argument of perigee", 34, 42, _PLAIN),
        ("mean anomaly", 43, 51, _PLAIN), ("mean motion", 52, 63, _PLAIN),
    ),
}  # fmt: skip
"""By line: name, first column from 0 and end, form. What is of no such form, SGP4 would read as something."""

_RANGES = {
    "inclination": (0.0, 180.0),
    "right ascension": (0.0, 360.0), "argument of perigee": (0.0, 360.0), "mean anomaly": (0.0, 360.0),
    "mean motion": (0.001, 20.0),
}  # fmt: skip
"""Degrees, and turns a day: 999.9999 and nothing at all are ways to write that there is none."""

_BEGINS = re.compile(r"[12] [ 0-9A-Z][ 0-9]{4}[ A-Z]( |$)")
"""How a line of an element set begins, whole or not; names of objects do not."""


@dataclass(frozen=True, slots=True)
class ElementSet:
    """name (empty if the file gives none), the two lines, and the epoch in GPS time [ns]."""

    name: str
    line1: str
    line2: str
    epoch_ns: int


def read(path: Path) -> list[ElementSet]:
    """The element sets of a file; FileError with one line if it has faults."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> list[ElementSet]:
    """The element sets in the text of a file, with or without lines of names; `origin` names it in errors.

    Blank lines and lines of comment (#) are passed over.
    """
    found: list[ElementSet] = []
    name, first, first_n = "", "", 0
    for n, line in enumerate(text.splitlines(), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        if first:
            second = _checked(line, "2", n, origin)
            if second[2:7] != first[2:7]:
                raise FileError(f"{origin}: line {n}: object is {second[2:7]!r}; line 1 says {first[2:7]!r}")
            found.append(ElementSet(name, first, second, _epoch_ns(first, first_n, origin)))
            name = first = ""
        elif line.startswith("1 ") and len(line) >= _LENGTH:
            first, first_n = _checked(line, "1", n, origin), n
        elif line.startswith("2 ") and _BEGINS.match(line):
            raise FileError(f"{origin}: line {n}: line 2 of an element set without line 1 before it")
        elif _BEGINS.match(line):
            raise FileError(f"{origin}: line {n}: {_not_whole(line, '1')}")
        else:
            name = line.removeprefix("0 ").strip()
    if first or not found:
        raise FileError(f"{origin}: {'line 2 of the last set is missing' if first else 'no element set'}")
    return found


def _epoch_ns(line: str, n: int, origin: str) -> int:
    """GPS time [ns] of columns 19-32: two digits of the year, day of the year with its fraction, UTC."""
    cell = line[18:32]
    try:
        year, day, fraction = int(cell[:2]), int(cell[2:5]), float(f"0{cell[5:].strip() or '.0'}")
        if not 1 <= day <= 366 or not 0 <= fraction < 1:
            raise ValueError(cell)
    except ValueError:
        raise FileError(f"{origin}: line {n}: epoch is {cell!r}; allowed is such as 12305.50000000") from None
    january = datetime((1900 if year >= _FIRST_YEAR else 2000) + year, 1, 1)
    return gpstime.from_utc(january + timedelta(days=day - 1 + fraction))


def _checked(line: str, number: str, n: int, origin: str) -> str:
    if not line.startswith(f"{number} ") or len(line) != _LENGTH:
        raise FileError(f"{origin}: line {n}: {_not_whole(line, number)}")
    total = sum(int(c) if c.isdigit() else c == "-" for c in line[:-1]) % 10
    if line[-1] != str(total):
        raise FileError(f"{origin}: line {n}: checksum is {line[-1]!r}; the line sums up to {total}")
    for name, begin, end, form in _FIELDS[number]:
        if not form.fullmatch(line[begin:end]):
            raise FileError(f"{origin}: line {n}: {name} is {line[begin:end]!r}, not a number of its form")
        if name in _RANGES:
            least, greatest = _RANGES[name]
            if not least <= float(line[begin:end].strip() or "nan") <= greatest:
                allowed = f"allowed is {least:g} to {greatest:g}"
                raise FileError(f"{origin}: line {n}: {name} is {line[begin:end].strip()!r}; {allowed}")
    return line


def _not_whole(line: str, number: str) -> str:
    """What is said of a line that is not line 1 or 2 of a set as a whole."""
    found = f"{len(line)} columns" if line.startswith(f"{number} ") else f"{line[:20]!r}"
    return f"not line {number} of an element set, which has {_LENGTH} columns with its checksum, but {found}"


def choose(sets: list[ElementSet], name: str | None, origin: str, near_ns: int) -> ElementSet:
    """Of the sets of one object the one whose epoch is nearest to near_ns, of several the last in the file.

    name   the object, by name in whatever case or by catalogue number; None if the file is of one alone
    FileError if the file has no such object, or several.
    """
    wanted = None if name is None else name.strip().casefold()
    mine = [s for s in sets if wanted in (None, s.name.casefold(), _number(s).casefold())]
    if len({_number(s) for s in mine}) == 1:
        return min(reversed(mine), key=lambda s: abs(s.epoch_ns - near_ns))
    objects = {_number(s): s.name or _number(s) for s in mine or sets}
    more = f" and {len(objects) - 12} more" if len(objects) > 12 else ""
    known = ", ".join(list(objects.values())[:12]) + more
    if mine and name is not None:
        known = f"several of that name, of numbers {', '.join(objects)}"
    asked = "object is missing" if name is None else f"object is {name!r}"
    raise FileError(f"{origin}: {asked}; the file has {known}")


def rivals(sets: list[ElementSet], chosen: ElementSet) -> int:
    """How many sets of the chosen one's object and epoch say something else."""
    return len({
        (s.line1, s.line2)
        for s in sets
        if _number(s) == _number(chosen) and s.epoch_ns == chosen.epoch_ns
    }) - 1  # fmt: skip


def _number(one: ElementSet) -> str:
    return one.line1[2:7].strip()
