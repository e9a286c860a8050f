"""Satellites' delays of the C/A code against the P code that their broadcast clocks belong to."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models.base import Context, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.code_biases import satellite_code_m
from gnss_hil.emulator.error_models.params_sky import CodeBias
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    """code_m  (n,) to be added to pseudoranges [m]."""

    code_m: F64

    def path(self, at: ChannelGeometry) -> PathTerm:
        return PathTerm(range_m=self.code_m[at.row])


def build(params: CodeBias, context: Context) -> ErrorModel:
    return Model(satellite_code_m(params, context.seed, context.satellites))


ROW = Row(
    "code_bias",
    CodeBias,
    Stage.PATH,
    "differences of P1 and C1 in IGS's cc2noncc (J. Ray)",
    build,
    "sky",
)
