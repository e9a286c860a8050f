"""Thermal noise of the frequency lock loop."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.error_models.base import CraftContext, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import Stream, normal
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, doppler_sigma_hz


class DopplerNoise(Factor):
    """Thermal noise of the frequency lock loop; no parameters but the loop's."""


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    loops: Loops
    stream: Stream

    def path(self, at: ChannelGeometry) -> PathTerm:
        standard = normal(self.stream.of_signals(at.epoch, at.receiver, at.sat))
        sigma_mps = at.wave_m * doppler_sigma_hz(10 ** (at.cn0_dbhz / 10), self.loops)
        return PathTerm(rate_mps=standard * sigma_mps)


def build(params: DopplerNoise, context: CraftContext) -> ErrorModel:
    return Model(context.loops, context.stream(ROW.name))


ROW = Row(
    "doppler_noise",
    DopplerNoise,
    Stage.PATH,
    "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9: FLL thermal noise",
    build,
    default=True,
    shows="RATE",
)
