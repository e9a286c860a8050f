"""Thermal noise of the phase lock loop, a Costas loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.emulator.error_models.base import CraftContext, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import Stream, normal
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, carrier_sigma_rad


class CarrierNoise(Factor):
    """Thermal noise of the phase lock loop, a Costas loop; no parameters but the loop's."""


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    loops: Loops
    stream: Stream

    def path(self, at: ChannelGeometry) -> PathTerm:
        standard = normal(self.stream.of_signals(at.epoch, at.receiver, at.sat))
        sigma_m = at.wave_m / (2 * np.pi) * carrier_sigma_rad(10 ** (at.cn0_dbhz / 10), self.loops)
        return PathTerm(phase_m=standard * sigma_m)


def build(params: CarrierNoise, context: CraftContext) -> ErrorModel:
    return Model(context.loops, context.stream(ROW.name))


ROW = Row(
    "carrier_noise",
    CarrierNoise,
    Stage.PATH,
    "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9: PLL thermal noise",
    build,
    default=True,
    shows="PHASE",
)
