"""Thermal noise of the delay lock loop."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.error_models.base import CraftContext, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import Stream, normal
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, code_sigma_chips


class CodeNoise(Factor):
    """Thermal noise of the delay lock loop, non-coherent; no parameters but the loop's."""


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    loops: Loops
    stream: Stream

    def path(self, at: ChannelGeometry) -> PathTerm:
        standard = normal(self.stream.of_signals(at.epoch, at.receiver, at.sat))
        sigma_m = at.chip_m * code_sigma_chips(10 ** (at.cn0_dbhz / 10), self.loops)
        return PathTerm(range_m=standard * sigma_m)


def build(params: CodeNoise, context: CraftContext) -> ErrorModel:
    return Model(context.loops, context.stream(ROW.name))


ROW = Row(
    "code_noise",
    CodeNoise,
    Stage.PATH,
    "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9: DLL thermal noise",
    build,
    default=True,
)
