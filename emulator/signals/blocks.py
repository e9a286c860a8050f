"""Blocks of satellites: which antenna they carry, how strong they are, who belongs to which and when."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

from dbc import satellites
from dbc.registry import table


@dataclass(frozen=True, slots=True)
class Block:
    """Satellites of one kind.

    pattern        shipped table of the transmit antenna
    received_dbw   what an isotropic antenna on the ground typically receives from one 5 deg high [dBW]
    source         of that level; the table names the source of the pattern
    """

    name: str
    system: int
    pattern: str
    received_dbw: float
    source: str


_KAPLAN = "Kaplan & Hegarty, Understanding GPS, 2nd ed., 3.3: edge of the Earth"
_WATTS_27 = "14.3 dBW into the antenna, as Stanford's LuPNT takes it, and the gain of the pattern"

BLOCKS = table(
    Block("gps-iia", satellites.GPS, "gps-iia", -156.4, _WATTS_27),
    Block("gps-iir", satellites.GPS, "gps-iir", -155.5, f"{_KAPLAN}, typical IIR"),
    Block("gps-iir-improved", satellites.GPS, "gps-iir-improved", -154.5, f"{_KAPLAN}, improved panel"),
    Block("gps-iif", satellites.GPS, "gps-iif", -156.4, _WATTS_27),
    Block("gps-iii", satellites.GPS, "gps-iir-improved", -154.5, "modelled: stands in as IIR-M, same maker"),
    Block("glonass-m", satellites.GLONASS, "glonass-m", -157.2, "27 dBW at 15 deg, see the table"),
)  # fmt: skip
NAMES = tuple(BLOCKS)
NO_BLOCK = len(NAMES)
"""Row of satellites of which nothing is known."""

_GPS_SINCE = """
    iir              1997-07-23  13
    iir              1999-10-07  11
    iir              2000-05-11  20
    iir              2000-07-16  28
    iir              2000-11-10  14
    iir              2001-01-30  18
    iir              2003-01-29  16
    iir              2003-03-31  21
    iir-improved     2003-12-21  22
    iir-improved     2004-03-20  19
    iir-improved     2004-06-23  23
    iir-improved     2004-11-06  2
    iir-improved     2005-09-26  17
    iir-improved     2006-09-25  31
    iir-improved     2006-11-17  12
    iir-improved     2007-10-17  15
    iir-improved     2007-12-20  29
    iir-improved     2008-03-15  7
    iir-improved     2009-08-17  5
    iif              2010-05-28  25
    iif              2011-07-16  1
    iif              2012-10-04  24
    iif              2013-05-15  27
    iif              2014-02-21  30
    iif              2014-05-17  6
    iif              2014-08-02  9
    iif              2014-10-29  3
    iif              2015-03-25  26
    iif              2015-07-15  8
    iif              2015-10-31  10
    iif              2016-02-05  32
    iii              2018-12-23  4
    iii              2019-08-22  18
    iii              2020-06-30  23
    iii              2020-11-05  14
    iii              2021-06-17  11
    iii              2023-01-18  28
"""
"""Block, first day, number. Launch dates, typed from memory; the state of January 2021 agrees with the table
of numbers and blocks in Stanford's LuPNT."""


def gps_blocks(day: date) -> dict[int, str]:
    """PRN -> block of the satellite that had it on that day; without a row, II or IIA."""
    found = dict.fromkeys(range(1, satellites.NUMBERS), "gps-iia")
    for block, since, number in (line.split() for line in _GPS_SINCE.strip().splitlines()):
        if date.fromisoformat(since) <= day:
            found[int(number)] = f"gps-{block}"
    return found


def block_rows(day: date, gps: str, chosen: dict[str, str]) -> NDArray[np.intp]:
    """Rows (512,) of BLOCKS over satellite indices; NO_BLOCK for other systems than GPS and GLONASS.

    day      whose constellation is meant
    gps      "by-date", or one block for all GPS satellites
    chosen   satellite name -> block, before everything else; ValueError if a name is of another system
    """
    rows = np.full(satellites.SATELLITES, NO_BLOCK)
    for number, block in gps_blocks(day).items():
        rows[satellites.index(satellites.GPS, number)] = NAMES.index(block if gps == "by-date" else gps)
    first = satellites.index(satellites.GLONASS, 0)
    rows[first : first + satellites.NUMBERS] = NAMES.index("glonass-m")
    for name, block in chosen.items():
        index = satellites.parse(name)
        if BLOCKS[block].system != satellites.system_of(index):
            raise ValueError(f"satellite {name} cannot be of block {block}")
        rows[index] = NAMES.index(block)
    return rows
