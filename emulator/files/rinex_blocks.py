"""Where the records of a RINEX navigation file begin and end, and what they say they are.

Versions 2 and 3 mark a record by a first line that is not indented; version 4 by a line of its own, such as
`> EPH G01 LNAV`.
Sources: RINEX 2.11, table A4; RINEX 3.05, table A6; RINEX 4.01, 5.4.1
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gnss_hil.emulator.files.text import FileError

KINDS = ("EPH", "STO", "EOP", "ION")
"""Ephemeris, system time offset, Earth orientation parameters, ionosphere."""


@dataclass(frozen=True, slots=True)
class Block:
    """Lines first to end (exclusive), 0-based; letter of the system, "" in version 2; kind, of KINDS; message
    such as LNAV, "" before version 4."""

    letter: str
    first: int
    end: int
    kind: str = "EPH"
    message: str = ""


def blocks(lines: list[str], start: int, version: float, origin: str) -> Iterator[Block]:
    """The records from line `start` on."""
    return _announced(lines, start, origin) if version >= 4 else _outdented(lines, start, version, origin)


def _outdented(lines: list[str], start: int, version: float, origin: str) -> Iterator[Block]:
    label = 2 if version < 3 else 1
    begins = [n for n in range(start, len(lines)) if lines[n][:label].strip()]
    _refuse_before(lines, start, begins, "the first line of a record", origin)
    for first, end in zip(begins, [*begins[1:], _last_line(lines, start)], strict=False):
        yield Block("" if version < 3 else lines[first][0].upper(), first, end)


def _announced(lines: list[str], start: int, origin: str) -> Iterator[Block]:
    begins = [n for n in range(start, len(lines)) if lines[n].startswith(">")]
    _refuse_before(lines, start, begins, "'>' and the kind of a record", origin)
    for head, end in zip(begins, [*begins[1:], _last_line(lines, start)], strict=False):
        kind, letter, message = (lines[head][a:b].strip().upper() for a, b in ((2, 5), (6, 7), (10, 14)))
        if kind not in KINDS or not letter or not message:
            allowed = f"allowed is such as '> EPH G01 LNAV', kinds {', '.join(KINDS)}"
            raise FileError(f"{origin}: line {head + 1}: record is '{lines[head].strip()}'; {allowed}")
        if end - head < 2:
            raise FileError(f"{origin}: line {end}: the {kind} record from line {head + 1} has no lines")
        yield Block(letter, head + 1, end, kind, message)


def _refuse_before(lines: list[str], start: int, begins: list[int], wanted: str, origin: str) -> None:
    """The error of lines that belong to no record."""
    for n in range(start, begins[0] if begins else len(lines)):
        if lines[n].strip():
            raise FileError(f"{origin}: line {n + 1}: expected {wanted}")


def _last_line(lines: list[str], start: int) -> int:
    """Number of lines without blank ones at the end."""
    end = len(lines)
    while end > start and not lines[end - 1].strip():
        end -= 1
    return end
