"""Satellites' antennas and powers."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Literal

from pydantic import Field

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.constellation import block_types
from gnss_hil.emulator.error_models.base import Context, Fixed, LinkTerm, Row, Stage, require_systems
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal import link_budget

GpsBlock = Literal["gps-iia", "gps-iir", "gps-iir-improved", "gps-iirm", "gps-iif", "gps-iii"]
Block = GpsBlock | Literal["glonass-m"]


class TransmitPattern(Factor):
    """Satellites' antennas and powers.

    level    "typical": as their makers and users published, signals beside L1 above their promise by as much
             as L1; "minimum": what the interface documents promise
    gps      block of all GPS satellites, or the one each number had on the day the run starts. It also says
             which signals they send
    blocks   satellite name ("G05") -> block, where that is not what is wanted
    """

    level: Literal["typical", "minimum"] = "typical"
    gps: GpsBlock | Literal["by-date"] = "by-date"
    blocks: dict[Annotated[str, Field(pattern=r"^[GR]\d\d$")], Block] = Field(default_factory=dict)


def transmitters_of(params: TransmitPattern, day: date) -> link_budget.Transmit:
    """Transmitters of all satellites as they were on that day; ValueError if a block is not the system's."""
    rows = block_types.block_rows(day, params.gps, params.blocks)
    return link_budget.transmit(rows, params.level)


def build(params: TransmitPattern, context: Context) -> Fixed[LinkTerm]:
    require_systems(context, {block.system for block in block_types.BLOCKS.values()}, "blocks")
    day = gpstime.to_calendar(context.start_ns).date()
    return Fixed(LinkTerm(transmitters=transmitters_of(params, day)))


ROW = Row(
    "transmit_pattern",
    TransmitPattern,
    Stage.LINK,
    "published patterns by block; IS-GPS-200, GLONASS ICD 5.1",
    build,
    shows="RATE",
)
