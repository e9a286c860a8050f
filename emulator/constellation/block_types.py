"""Blocks of satellites: antennas, powers, and which satellite belongs to which block when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date

import numpy as np

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.arrays import Bool, Index
from gnss_hil.dbc.common.registry import table
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.emulator.constellation.space_vehicles import gps_types, gps_vehicles


@dataclass(frozen=True, slots=True)
class Block:
    """Satellites of one kind.

    pattern        shipped table of the transmit antenna
    received_dbw   what an isotropic antenna on the ground typically receives from one 5 deg high [dBW]
    source         of that level; the table names the source of the pattern
    others         signals it sends beside its system's first -> what its interface document promises of them
                   on the ground [dBW]
    """

    name: str
    system: int
    pattern: str
    received_dbw: float
    source: str
    others: Mapping[str, float] = field(default_factory=dict)


_KAPLAN = "Kaplan & Hegarty, Understanding GPS, 2nd ed., 3.3: edge of the Earth"
_L2C, _L5 = {"L2C": -160.0}, {"L5": -157.9}
_III = {"L2C": -158.5, "L5": -157.0}
"""Which block sends which civil signal, and how strong at least: IS-GPS-200, 3.2.2 and table 3-Va (L2C from
block IIR-M on); IS-GPS-705, 3.3.1.6 and table 3-III (L5 from block IIF on, one of two components)."""

_L2OF = {"L2OF": -167.0}
"""GLONASS ICD 5.1 (2008), 3.3.1.1 (GLONASS-M) and 3.3.1.6."""

_WATTS_27 = "14.3 dBW into the antenna, as Stanford's LuPNT takes it, and the gain of the pattern"

BLOCKS = table(
    Block("gps-iia", satellites.GPS, "gps-iia", -156.4, _WATTS_27),
    Block("gps-iir", satellites.GPS, "gps-iir", -155.5, f"{_KAPLAN}, typical IIR"),
    Block("gps-iir-improved", satellites.GPS, "gps-iir-improved", -154.5, f"{_KAPLAN}, improved panel"),
    Block("gps-iirm", satellites.GPS, "gps-iir-improved", -154.5, f"{_KAPLAN}, improved panel", _L2C),
    Block("gps-iif", satellites.GPS, "gps-iif", -156.4, _WATTS_27, {**_L2C, **_L5}),
    Block("gps-iii", satellites.GPS, "gps-iir-improved", -154.5, "modelled: stands in as IIR-M", _III),
    Block("glonass-m", satellites.GLONASS, "glonass-m", -157.2, "27 dBW at 15 deg, see the table", _L2OF),
)  # fmt: skip
NAMES = tuple(BLOCKS)
NO_BLOCK = len(NAMES)
"""Row of satellites of unknown blocks."""

PANELS = {
    "iia": "gps-iia", "iir": "gps-iir", "iirm": "gps-iirm", "iif": "gps-iif", "iii": "gps-iii",
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


def sent_signals(rows: Index) -> Bool:
    """(16, 512) whether satellites send signals, by value on the bus and satellite index: each its system's
    first, and what its block has beside.

    rows  (512,) of BLOCKS, as `block_rows`
    """
    sent = np.zeros((signals.COUNT, satellites.SATELLITES), bool)
    system = satellites.system_of(np.arange(satellites.SATELLITES))
    for signal in signals.SIGNALS.values():
        if not signals.beyond_first()[signal.value]:
            sent[signal.value] = system == SYSTEMS[signal.system].value
    for row, block in enumerate(BLOCKS.values()):
        for name in block.others:
            sent[signals.SIGNALS[name].value] |= rows == row
    return sent
