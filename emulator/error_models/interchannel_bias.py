"""Delays of a receiver that differ with GLONASS frequency, in code; and of the receiver as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models.base import Context, ErrorModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.code_biases import FREQUENCIES, receiver_code_m
from gnss_hil.emulator.error_models.params_receiver import InterchannelBias
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry

_NUMBERED = signals.has_frequency_numbers()
"""(8,) by system: whether satellites have carriers of their own."""


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    """common_m (m,) of all signals of a receiver;  glonass_m (m, 21) by frequency number [m]."""

    common_m: F64
    glonass_m: F64

    def path(self, at: ChannelGeometry) -> PathTerm:
        number = at.epochs.sky.frequency[at.at, at.row] - FREQUENCIES[0]
        own_m = np.where(_NUMBERED[at.system], self.glonass_m[at.receiver, number], 0.0)
        return PathTerm(range_m=self.common_m[at.receiver] + own_m)


def build(params: InterchannelBias, context: Context) -> ErrorModel:
    return Model(*receiver_code_m(params, context.seed, context.key, context.vehicle.antennas))


ROW = Row(
    "interchannel_bias",
    InterchannelBias,
    Stage.PATH,
    "Jiang & Lewandowski, Int. J. Navigation Observ. (2012) 353961, table 7",
    build,
)
