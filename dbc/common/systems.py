"""Navigation satellite systems: one row each, and everything that depends on the system reads it here.

A system is a small integer on the bus (`value`) and a name in files. A row with a place for its time offset
in NAV_CLOCK, or the reference itself, is one that receivers track and fixes use; the others are only named
by the contract.

To add a nominal system that flies end to end: rows in `dbc/common/systems.py`, `dbc/common/signals.py`,
`emulator/signal/powers.py` and `emulator/constellation/registry.py`, and its slots in
`emulator/constellation/nominal.py`. Bus, scenario keys, search, commands, fixes, tables and exported ranges
and orbits follow; `tests/system/test_third_system.py` flies one that is made up. What else GPS and GLONASS
have, each thing for itself and refused or left out by name until it is there:

    messages that are read    `emulator/constellation/broadcast/NAME.py`, `emulator/files/rinex_layouts.py`
    messages that are written `emulator/constellation/nominal_messages.py`,
                              `emulator/constellation/messages.py`, `tools/export/rinex_systems.py`
    almanacs                  `emulator/constellation/almanac/NAME.py`,
                              `emulator/constellation/almanac/orbits.py`, `emulator/files/almanacs.py`
    blocks, patterns          `emulator/constellation/block_types.py`,
                              `emulator/error_models/transmit_pattern.py`, a file in `emulator/data/patterns`
    uploads and their errors  `emulator/constellation/uploads.py`,
                              `emulator/constellation/misreported.py`,
                              `emulator/error_models/ephemeris_error.py`,
                              `emulator/error_models/satellite_clock_error.py`
    frames of messages        `emulator/signal/data_frames.py`
    phase centres of SP3      `emulator/constellation/antenna_offsets.py`,
                              `emulator/constellation/phase_centre.py`
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.registry import table

COUNT = 8
"""Systems that the contract's three bits can name."""

CLOCK_DOMAINS = 8
"""Items of NAV_CLOCK below this are clock domains, those from it on time offsets of systems."""


@dataclass(frozen=True, slots=True)
class System:
    """One system.

    name              in scenarios; in capitals the label of the contract's table "SatSystem"
    letter            of RINEX 3; I for later inter-satellite ranges
    value             on the bus, 0..7
    numbers           PRNs or slots that it has room for, 1..numbers; 0 where no receiver tracks it
    orbit_radius_m    semi-major axis the system is built for [m]
    reference         its time is the scale of fixes and clocks
    time_offset_item  item of NAV_CLOCK with what its pseudoranges are longer than the reference's; None for
                      the reference, and for systems that no fix uses
    """

    name: str
    letter: str
    value: int
    numbers: int = 0
    orbit_radius_m: float = np.nan
    reference: bool = False
    time_offset_item: int | None = None
    source: str = ""

    @property
    def tracked(self) -> bool:
        """Whether receivers track its satellites and fixes use them."""
        return self.reference or self.time_offset_item is not None


SYSTEMS: dict[str, System] = table(
    System("gps", "G", 0, 32, 26_559_700.0, reference=True,
           source="IS-GPS-200, 3.2.1.3; GPS SPS Performance Standard, 4th edition (2008), table 3.2-2"),
    System("glonass", "R", 1, 24, 25_508_000.0, time_offset_item=8,
           source="GLONASS ICD 5.1 (2008), table 4.3 (slots), 3.1.2"),
    System("galileo", "E", 2),
    System("beidou", "C", 3),
    System("sbas", "S", 4),
    System("qzss", "J", 5),
    System("intersatellite", "I", 6),
)  # fmt: skip
"""By name, in the order of tables, reports and searches. Letters: RINEX 3.05, table 1."""


def by_value(value: int) -> System | None:
    """The system with this number on the bus, None if no row has it."""
    return next((system for system in SYSTEMS.values() if system.value == value), None)


def by_letter(letter: str) -> System | None:
    """The system with this RINEX letter, None if no row has it."""
    return next((system for system in SYSTEMS.values() if system.letter == letter), None)


def tracked() -> tuple[System, ...]:
    """Systems that receivers track and fixes use, in order."""
    return tuple(system for system in SYSTEMS.values() if system.tracked)


def reference() -> System:
    """The system whose time is that of fixes; the others have an offset from it."""
    (only,) = (system for system in SYSTEMS.values() if system.reference)
    return only


def column(of: Callable[[System], Any], missing: Any) -> NDArray:
    """A property of all systems as (COUNT,) over values on the bus; `missing` where there is no row."""
    values = [missing] * COUNT
    for system in SYSTEMS.values():
        values[system.value] = of(system)
    return np.array(values)


def offset_items() -> NDArray[np.int64]:
    """(COUNT,) items of NAV_CLOCK with the systems' time offsets; -1 for the reference and unused systems."""
    return column(lambda s: -1 if s.time_offset_item is None else s.time_offset_item, -1)
