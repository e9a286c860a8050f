"""Where the satellites of each system come from, and their messages: one row a system.

A scenario writes a system's sky as `name = "nominal"`, or as files of navigation messages or precise orbits.
A system of the contract's table (`gnss_hil.dbc.common.systems`) without a row here has no sky but "none" and
precise orbits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.constellation import messages, misreported, nominal_messages
from gnss_hil.emulator.constellation.base import Constellation, ReportErrors, Spanned
from gnss_hil.emulator.constellation.broadcast import glonass, gps
from gnss_hil.emulator.constellation.broadcast.glonass import GlonassConstellation
from gnss_hil.emulator.constellation.broadcast.gps import GpsConstellation
from gnss_hil.emulator.constellation.nominal import NominalConstellation, nominal_glonass, nominal_gps
from gnss_hil.emulator.constellation.nominal_messages import Stretch
from gnss_hil.emulator.files.rinex_nav import Records


@dataclass(frozen=True, slots=True)
class Maker:
    """How one system's constellation is made, and its messages from that.

    name          of the system
    nominal       start of the run, GPS time [ns] -> its slots, every one taken
    from_records  navigation records (m,) and each record's -tau_c (m,) [s] -> its satellites; None where no
                  navigation file is read
    messages      kind of constellation -> maker of navigation records: of the satellites, those that serve a
                  stretch of time, in WGS-84 or in the system's own frame; empty where none are made
    places        records in WGS-84, numbers of satellites (k,), GPS times (k,) [ns] -> where the records put
                  them (k, 3) [m], ECEF; None only where no messages are made
    misreported   messages of nominal satellites, these, and errors -> the messages that are off by them; None
                  only where no messages are made
    """

    name: str
    nominal: Callable[[int], Constellation]
    from_records: Callable[[Records, F64], Spanned] | None = None
    messages: Mapping[type, Callable[[Any, Stretch, bool], Records]] = field(default_factory=dict)
    places: Callable[[Records, I64, I64], F64] | None = None
    misreported: Callable[[Records, NominalConstellation, Sequence[ReportErrors]], Records] | None = None


MAKERS: dict[str, Maker] = table(
    Maker(
        "gps",
        nominal_gps,
        lambda records, glonass_to_utc_s: gps.from_records(records),
        {GpsConstellation: messages.broadcast_gps, NominalConstellation: nominal_messages.gps_records},
        messages.gps_places,
        misreported.gps,
    ),
    Maker(
        "glonass",
        nominal_glonass,
        glonass.from_records,
        {
            GlonassConstellation: messages.broadcast_glonass,
            NominalConstellation: nominal_messages.glonass_records_of,
        },
        messages.glonass_places,
        misreported.glonass,
    ),
)
"""By name of the system."""


def records_of(
    system: str,
    constellation: Constellation,
    stretch: Stretch,
    wgs84: bool = True,
    errors: Sequence[ReportErrors] = (),
) -> Records | None:
    """The navigation records of a system's satellites that serve a stretch of time; None where none are made:
    precise orbits have none, nor has a system without makers of them.

    wgs84   states in WGS-84 instead of the system's own frame
    errors  what nominal satellites report too much; messages of files stay what they are
    """
    row = MAKERS.get(system)
    maker = row.messages.get(type(constellation)) if row else None
    made = maker(constellation, stretch, wgs84) if maker else None
    if made and errors and row and row.misreported and isinstance(constellation, NominalConstellation):
        return row.misreported(made, constellation, errors)
    return made
