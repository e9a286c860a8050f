"""Carrier loops that slip cycles, whole or half.

A Costas loop tracks twice the phase, so that its stable points lie half a cycle apart and noise weighs
double.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import F64, I64, U64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.error_models.base import CraftContext, Row, Stage, TrackingTerm
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, jitter_rad, slip_rate_hz


class CycleSlips(Factor):
    """Slips of the carrier loops.

    costas     loops that ignore the data's sign, whose slips are half cycles; else whole ones
    per_hour   slips of every channel that nothing here causes (modelled)
    """

    costas: bool = True
    per_hour: Annotated[float, Field(ge=0, le=3600)] = 0.0


def slips(parameters: CycleSlips, loops: Loops, raw: U64, cn0_dbhz: F64, dt_s: float) -> I64:
    """Half cycles (p,) by which carrier phases slip in an epoch: 0, or 1 (Costas) or 2 to either side.

    raw  (p,) random words;  cn0_dbhz (p,);  dt_s length of the epoch
    """
    order = 2 if parameters.costas else 1
    snr = 1 / (order * jitter_rad(loops, 10 ** (cn0_dbhz / 10))) ** 2
    rate_hz = slip_rate_hz(snr, loops.carrier_bandwidth_hz) + parameters.per_hour / 3600
    slipped = keyed_draws.uniform(raw) < -np.expm1(-rate_hz * dt_s)
    # `uniform` leaves out the lowest bits: the last one tells the side.
    side = 1 - 2 * (raw & np.uint64(1)).astype(np.int64)
    return np.where(slipped, side * (2 // order), 0)


@dataclass(frozen=True, slots=True)
class Model:
    params: CycleSlips
    loops: Loops
    stream: Stream
    interval_s: float

    def block(self, at: ChannelGeometry | None) -> TrackingTerm:
        if at is None:
            return TrackingTerm()
        raw = self.stream.of_signals(at.epoch, at.receiver, at.sat, at.signal)
        return TrackingTerm(slips(self.params, self.loops, raw, at.cn0_dbhz, self.interval_s))


def build(params: CycleSlips, context: CraftContext) -> Model:
    return Model(params, context.loops, context.stream(ROW.name), context.interval_ns / NS_PER_S)


ROW = Row(
    "cycle_slips",
    CycleSlips,
    Stage.TRACKING,
    "Viterbi, Proc. IEEE 51 (1963) 1737",
    build,
    shows="PHASE",
)
