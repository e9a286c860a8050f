"""Where the satellites of each system come from: one row a system.

A scenario writes a system's sky as `name = "nominal"`, or as files of navigation messages or precise orbits.
A system of the contract's table (`gnss_hil.dbc.common.systems`) without a row here has no sky but "none" and
precise orbits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.constellation.base import Constellation, Spanned
from gnss_hil.emulator.constellation.broadcast import glonass, gps
from gnss_hil.emulator.constellation.nominal import nominal_glonass, nominal_gps
from gnss_hil.emulator.files.rinex_nav import Records


@dataclass(frozen=True, slots=True)
class Maker:
    """How one system's constellation is made.

    name          of the system
    nominal       start of the run, GPS time [ns] -> its slots, every one taken
    from_records  navigation records (m,) and each record's -tau_c (m,) [s] -> its satellites; None where no
                  navigation file is read
    """

    name: str
    nominal: Callable[[int], Constellation]
    from_records: Callable[[Records, F64], Spanned] | None = None


MAKERS: dict[str, Maker] = table(
    Maker("gps", nominal_gps, lambda records, glonass_to_utc_s: gps.from_records(records)),
    Maker("glonass", nominal_glonass, glonass.from_records),
)
"""By name of the system."""
