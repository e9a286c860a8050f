"""Turns of the transmitting and receiving antennas about the way of the signal."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models.base import CraftContext, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal import phase_windup
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry


class PhaseWindup(Factor):
    """Turns of the transmitting and receiving antennas about the way of the signal; no parameters."""


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    """axes_body  x and y (m, 3) of the craft's antennas."""

    axes_body: tuple[F64, F64]

    def block(self, at: ChannelGeometry) -> PathTerm:
        epochs, receiver = at.epochs, (at.at, at.receiver)
        x, y = ((axis @ epochs.dcm_body_from_ecef)[receiver] for axis in self.axes_body)
        rate = (epochs.rate_body_rps[:, None] @ epochs.dcm_body_from_ecef)[:, 0]
        cycles, per_s = phase_windup.windup_and_rate(
            epochs.motion.pos_m[at.at, at.row],
            epochs.motion.vel_mps[at.at, at.row],
            epochs.sun_ecef_m[at.at],
            epochs.antennas.pos_m[receiver],
            epochs.antennas.vel_mps[receiver],
            (x, y),
            rate[at.at],
        )
        return PathTerm(rate_mps=per_s * at.wave_m, turns_cyc=cycles)


def build(params: PhaseWindup, context: CraftContext) -> Model:
    return Model(phase_windup.antenna_axes(context.vehicle.boresight_body))


ROW = Row(
    "phase_windup",
    PhaseWindup,
    Stage.PATH,
    "Wu et al., Manuscripta Geodaetica 18 (1993) 91",
    build,
    shows="PHASE",
)
