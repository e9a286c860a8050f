"""Antenna gain by angle off the axis, read from a text table.

Lines that start with `%` or `#` are comments. The others hold an angle [deg] and gains [dB], separated by
blanks, tabs or commas; one heading line of names may stand before the numbers. Angles count up, from 0 or
from below 0 (the other side of the cut, not used) to at most 180.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.files.text import FileError, read_text

_LEAST_DB, _MOST_DB = -200.0, 60.0
"""99 and 999 are ways to write that there is none."""


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """Gain by angle.

    angle_deg   (k,) from 0 upwards, at most 180
    gain_db     (k,) dBi, or dBW where the table is one of EIRP
    source      file or law
    """

    angle_deg: F64
    gain_db: F64
    source: str


def read(path: Path, column: str = "") -> Pattern:
    """The pattern of a table file; `column` names the gain where there are several.

    FileError naming file, line, field and what was found if it is none.
    """
    return parse(read_text(path), str(path), column)


def parse(text: str, origin: str, column: str = "") -> Pattern:
    """The pattern of a table's text; `origin` names it in errors."""
    lines = _lines(text)
    if not lines:
        raise FileError(f"{origin}: no line with an angle and a gain")
    names = () if _is_number(lines[0][1][0]) else tuple(lines.pop(0)[1])
    wanted = _column(names, column, len(lines[0][1]) if lines else 2, origin)
    rows = [(number, *_row(cells, wanted, f"{origin}: line {number}")) for number, cells in lines]
    for (_, before, _), (number, angle, _) in pairwise(rows):
        if angle <= before:
            raise FileError(f"{origin}: line {number}: angle is {angle:g}; it must be above {before:g}")
    used = np.array([(angle, gain) for _, angle, gain in rows if angle >= 0])
    if len(used) < 2 or used[0, 0] != 0:
        raise FileError(f"{origin}: angles do not start at 0 with at least two rows")
    return Pattern(used[:, 0], used[:, 1], origin)


def _lines(text: str) -> list[tuple[int, list[str]]]:
    """Numbers and cells of the lines that are neither blank nor comment."""
    numbered = ((number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    return [(n, re.split(r"\s*,\s*|\s+", line)) for n, line in numbered if line[:1] not in ("", "%", "#")]


def _column(names: tuple[str, ...], column: str, width: int, origin: str) -> int:
    gains = names[1:] or tuple(str(i) for i in range(1, width))
    if column in gains:
        return 1 + gains.index(column)
    if not column and len(gains) == 1:
        return 1
    found = f"column '{column}' is not there" if column else "it has several gain columns"
    raise FileError(f"{origin}: {found}; choose one of {', '.join(gains) or 'none'}")


def _row(cells: list[str], wanted: int, where: str) -> tuple[float, float]:
    if len(cells) <= wanted:
        raise FileError(f"{where}: {len(cells)} of at least {wanted + 1} values")
    angle_deg = _number(cells[0], "angle", -180, 180, where)
    return angle_deg, _number(cells[wanted], "gain", _LEAST_DB, _MOST_DB, where)


def _number(cell: str, field: str, least: float, most: float, where: str) -> float:
    if not _is_number(cell):
        raise FileError(f"{where}: {field} is '{cell[:20]}'; a number is needed")
    value = float(cell)
    if not least <= value <= most:
        raise FileError(f"{where}: {field} is {value:g}; it must be {least:g} to {most:g}")
    return value


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False
