"""Carrier loops that slip cycles, whole or half."""

from __future__ import annotations

from dataclasses import dataclass

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.error_models.base import Context, ErrorModel, Row, Stage, TrackingTerm
from gnss_hil.emulator.error_models.params_receiver import CycleSlips
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops
from gnss_hil.emulator.signal.tracking_loss import slips


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    params: CycleSlips
    loops: Loops
    stream: Stream
    interval_s: float

    def tracking(self, at: ChannelGeometry | None) -> TrackingTerm:
        if at is None:
            return TrackingTerm()
        raw = self.stream.of_signals(at.epoch, at.receiver, at.sat)
        return TrackingTerm(slips(self.params, self.loops, raw, at.cn0_dbhz, self.interval_s))


def build(params: CycleSlips, context: Context) -> ErrorModel:
    return Model(params, context.loops, context.stream(ROW.name), context.interval_ns / NS_PER_S)


ROW = Row(
    "cycle_slips",
    CycleSlips,
    Stage.TRACKING,
    "Viterbi, Proc. IEEE 51 (1963) 1737",
    build,
    shows="PHASE",
)
