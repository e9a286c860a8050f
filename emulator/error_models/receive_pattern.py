"""The craft's antennas."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.error_models.base import Context, ErrorModel, LinkTerm, Row, Stage
from gnss_hil.emulator.error_models.params_link import ReceivePattern
from gnss_hil.emulator.signal import equipment


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    term: LinkTerm

    def link(self) -> LinkTerm:
        return self.term


def build(params: ReceivePattern, context: Context) -> ErrorModel:
    return Model(LinkTerm(antennas=equipment.antennas_of(params, context.vehicle.names)))


ROW = Row(
    "receive_pattern",
    ReceivePattern,
    Stage.LINK,
    "tables by angle, shipped or of a file",
    build,
    shows="RATE",
)
