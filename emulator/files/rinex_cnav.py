"""Inter-signal corrections of GPS: what civil messages say of single signals, in files of RINEX 4.

Nothing else of these messages is read; what is wrong with a file otherwise its reader tells,
`gnss_hil.emulator.files.rinex_nav`.
Sources: RINEX 4.01 (IGS/RTCM, 2023), table of GPS CNAV; IS-GPS-200, 30.3.3.3.1.1
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gnss_hil.emulator.files.rinex_blocks import Block, blocks
from gnss_hil.emulator.files.text import FileError, read_text

FIELDS = ("L1CA", "L2C", "L5I5", "L5Q5")
"""Of the record's seventh line after its epoch's, in file order."""

_LINE, _FIRST, _WIDTH = 7, 4, 19

NONE_S = 4096 * 2.0**-35
"""A correction of this size stands for none: the most negative of 13 bits (30.3.3.3.1.1.1)."""

_ROUNDED = 1e-9
"""Share of a number by which twelve digits may differ from it."""


def read(path: Path) -> dict[int, Mapping[str, float]]:
    """PRN -> FIELDS -> correction [s], by the last record of each satellite that has any; a correction that a
    record lacks is left out. FileError where one is no number, or beyond what a message can say."""
    return parse(read_text(Path(path)), str(path))


def parse(text: str, origin: str) -> dict[int, Mapping[str, float]]:
    """The same of the text of a file; `origin` names it in errors."""
    lines = text.splitlines()
    end = next(
        (n for n, line in enumerate(lines) if line[60:].upper().startswith("END OF HEADER")), len(lines)
    )
    if not lines or not lines[0][:9].strip().startswith("4"):
        return {}
    found: dict[int, Mapping[str, float]] = {}
    for block in blocks(lines, end + 1, 4.0, origin):
        if (block.kind, block.letter, block.message) == ("EPH", "G", "CNAV"):
            number, given = lines[block.first][1:3], _corrections(lines, block, origin)
            if given and number.strip().isdecimal():
                found[int(number)] = given
    return found


def _corrections(lines: list[str], block: Block, origin: str) -> dict[str, float]:
    at = block.first + _LINE
    if at >= block.end:
        return {}
    found: dict[str, float] = {}
    for k, name in enumerate(FIELDS):
        place = _FIRST + k * _WIDTH
        text = lines[at][place : place + _WIDTH].strip().upper().replace("D", "E")
        if not text:
            continue
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not abs(value) <= NONE_S * (1 + _ROUNDED):
            allowed = f"allowed is {-NONE_S:.3g} to {NONE_S:.3g} s, or blank"
            raise FileError(f"{origin}: line {at + 1}: ISC_{name} is '{text}'; {allowed}")
        if abs(value) < NONE_S * (1 - _ROUNDED):
            found[name] = value
    return found
