"""Electrons around the Earth: code late, carrier and its rate early. Range rates are the carrier's."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.error_models.base import Context, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params_ionosphere import Ionosphere
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.geometry import spin
from gnss_hil.emulator.signal.ionosphere.delay import delay_m
from gnss_hil.emulator.signal.ionosphere.field import Field
from gnss_hil.emulator.signal.ionosphere.prepare import build_field
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_and_rate


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    field: Field

    def path(self, at: ChannelGeometry) -> PathTerm:
        epochs, place = at.epochs, (at.at, at.receiver)
        pos_m = epochs.antennas.pos_m[place]
        vel_mps = epochs.antennas.vel_mps[place] - spin(pos_m)
        sky, satellite = epochs.sky, (at.at, at.row)
        since_ns = epochs.t_ns[at.at] - epochs.t_ns[0]
        content, rate = slant_tec_and_rate(
            self.field, int(epochs.t_ns[0]), pos_m, vel_mps, sky.pos_ecef_m[satellite],
            sky.vel_ecef_mps[satellite], 1e-9 * since_ns,
        )  # fmt: skip
        carrier_hz = LIGHT_MPS / at.wave_m
        delay = delay_m(content, carrier_hz)
        return PathTerm(delay, -delay, -delay_m(rate, carrier_hz))


def build(params: Ionosphere, context: Context) -> ErrorModel:
    return Model(build_field(params, [context.open_path(name) for name in params.files], context.span_ns))


ROW = Row(
    "ionosphere",
    Ionosphere,
    Stage.PATH,
    "IS-GPS-200, 20.3.3.5.2.5; IONEX 1.0; Chapman layers",
    build,
    "sky",
)
