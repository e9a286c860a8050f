"""Blocks of satellites: antennas, powers, and which satellite belongs to which block when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import Index
from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.constellation.space_vehicles import gps_types, gps_vehicles


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
"""Row of satellites of unknown blocks."""

PANELS = {
    "iia": "gps-iia", "iir": "gps-iir", "iirm": "gps-iir-improved", "iif": "gps-iif", "iii": "gps-iii",
}  # fmt: skip
"""Type of a space vehicle -> block."""

IMPROVED = ("47", "59", "60", "61")
"""IIR vehicles with the improved panel. W. Marquis, The GPS Block IIR/IIR-M Antenna Panel Pattern, 2014.
"""


def gps_blocks(day: date) -> dict[int, str]:
    """PRN -> block of the satellite that had it on that day; without one, II or IIA."""
    found, types = dict.fromkeys(range(1, satellites.NUMBERS), "gps-iia"), gps_types()
    for number, vehicle in gps_vehicles(day).items():
        found[number] = "gps-iir-improved" if vehicle in IMPROVED else PANELS[types[vehicle][0]]
    return found


def block_rows(day: date, gps: str, chosen: Mapping[str, str]) -> Index:
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
