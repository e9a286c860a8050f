"""Antenna gain by angle off the axis, read from a text table.

What follows `%` or `#` is a comment. Lines hold an angle [deg] and gains [dB], separated by blanks, tabs,
commas or semicolons; one heading line of names may stand before the numbers. Angles count up, from 0 or
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

_IN_RADIANS = 0.01

_DEEPEST_DB = 60.0
"""No null of an antenna is so deep between one angle of a table and the next; -99 stands for none."""

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
    _check(used, origin)
    return Pattern(used[:, 0], used[:, 1], origin)


def _check(used: F64, origin: str) -> None:
    """FileError of a table (k, 2) that is likely to mean something else than it says."""
    last = used[-1, 0]
    if min(abs(last - math.pi / 2), abs(last - math.pi)) < _IN_RADIANS:
        raise FileError(f"{origin}: angles end at {last:g}, as those in radians do; degrees are read")
    before, gain, after = used[:-2, 1], used[1:-1, 1], used[2:, 1]
    holes = np.flatnonzero(np.minimum(before, after) - gain > _DEEPEST_DB)
    if len(holes):
        at = int(holes[0]) + 1
        raise FileError(
            f"{origin}: gain at {used[at, 0]:g} deg is {used[at, 1]:g}, between {used[at - 1, 1]:g} and "
            f"{used[at + 1, 1]:g}: leave the line out if there is none"
        )


def _lines(text: str) -> list[tuple[int, list[str]]]:
    """Numbers and cells of the lines that are neither blank nor comment."""
    bare = (re.split("[%#]", line, maxsplit=1)[0].strip() for line in text.splitlines())
    return [(n, re.split(r"\s*[,;]\s*|\s+", line)) for n, line in enumerate(bare, 1) if line]


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
