"""Satellites' antennas and powers."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.error_models.base import Context, ErrorModel, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params_link import TransmitPattern
from gnss_hil.emulator.signal import equipment


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    term: LinkTerm

    def link(self) -> LinkTerm:
        return self.term


def build(params: TransmitPattern, context: Context) -> ErrorModel:
    day = gpstime.to_calendar(context.start_ns).date()
    return Model(LinkTerm(transmitters=equipment.transmitters_of(params, day)))


ROW = Row(
    "transmit_pattern",
    TransmitPattern,
    Stage.LINK,
    "published patterns by block; IS-GPS-200, GLONASS ICD 5.1",
    build,
    shows="RATE",
)
