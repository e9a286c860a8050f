"""Delays of a receiver that differ with GLONASS frequency and with the signal, in code; and of the whole.

Drawn once for a run. Carrier phases have none: theirs are swallowed by ambiguities.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.emulator.error_models.base import CraftContext, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry


class InterchannelBias(Factor):
    """Delays of a receiver that differ with GLONASS frequency, in code; and of the receiver as a whole.

    slope_m_per_channel   1 sigma over receivers of what a frequency number adds [m]
    scatter_m             1 sigma of each frequency number's own
    hardware_m            1 sigma of the delay common to all signals of a receiver
    band_m                1 sigma of what a signal beside a system's first differs by, in all of a receiver:
                          what calibration leaves (modelled)
    Slope and scatter are fitted: two receivers differ as those of the links OP-PTB and SU-PTB do, by -2.2 to
    2.5 ns for 20 satellites, in Jiang & Lewandowski, Int. J. Navigation Observ. (2012) 353961, table 7. Two
    pairs that share a receiver tell a slope to a factor of two at best; the common delay is modelled
    """

    slope_m_per_channel: Annotated[float, Field(ge=0, le=10)] = 0.02
    scatter_m: Annotated[float, Field(ge=0, le=100)] = 0.16
    hardware_m: Annotated[float, Field(ge=0, le=1000)] = 3.0
    band_m: Annotated[float, Field(ge=0, le=1000)] = 0.3


_NUMBERED = signals.has_frequency_numbers()
"""(8,) by system: whether satellites have carriers of their own."""


FREQUENCIES = np.arange(-7, 14)
"""GLONASS frequency numbers. GLONASS ICD 5.1 (2008), 3.3.1.1, table 3.1."""

_PER_RECEIVER = 24  # one delay, one slope, a number for each frequency, one spare

_NUMBERS_OF: tuple[int, ...] = tuple(dict.fromkeys(signals.beyond_first().tolist()))
"""Numbers under which delays are drawn: 0 for the systems' first signals, a signal's value for each other."""


def receiver_code_m(
    parameters: InterchannelBias, seed: int, craft_key: int, receivers: int, number: int = 0
) -> tuple[F64, F64]:
    """What to add to pseudoranges [m]: (m,) all of a receiver's, and (m, 21) those of GLONASS by frequency
    number, FREQUENCIES.

    number  0 of the systems' first signals; of others, their value on the bus: they have the delay of the
            first, a difference from it, and frequencies' delays of their own
    """
    stream = Stream(seed, craft_key, "interchannel_bias")

    def drawn(number: int) -> F64:
        raw = stream.words(number, MAX_RECEIVERS * _PER_RECEIVER)
        return keyed_draws.normal(raw).reshape(MAX_RECEIVERS, _PER_RECEIVER)[:receivers]

    first, own = drawn(0), drawn(number)
    common_m = parameters.hardware_m * first[:, 0]
    if number:
        common_m = common_m + parameters.band_m * own[:, 0]
    slope = parameters.slope_m_per_channel * own[:, 1:2]
    return common_m, slope * FREQUENCIES + parameters.scatter_m * own[:, 2 : 2 + len(FREQUENCIES)]


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    """common_m (16, m) of signals, by their values on the bus, and receivers;  glonass_m (16, m, 21) by
    frequency number besides [m]."""

    common_m: F64
    glonass_m: F64

    def block(self, at: ChannelGeometry) -> PathTerm:
        number = at.epochs.sky.broadcast.frequency[at.at, at.row] - FREQUENCIES[0]
        own_m = np.where(_NUMBERED[at.system], self.glonass_m[at.signal, at.receiver, number], 0.0)
        return PathTerm(range_m=self.common_m[at.signal, at.receiver] + own_m)


def build(params: InterchannelBias, context: CraftContext) -> Model:
    drawn = {
        number: receiver_code_m(params, context.seed, context.key, context.vehicle.antennas, number)
        for number in _NUMBERS_OF
    }
    common_m, glonass_m = zip(*(drawn[number] for number in signals.beyond_first().tolist()), strict=True)
    return Model(np.array(common_m), np.array(glonass_m))


ROW = Row(
    "interchannel_bias",
    InterchannelBias,
    Stage.PATH,
    "Jiang & Lewandowski, Int. J. Navigation Observ. (2012) 353961, table 7",
    build,
)
