"""Free oscillators in place of the bounded wander, one for each clock domain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.clocks import oscillator
from gnss_hil.emulator.error_models.base import Context, Epochs, ErrorModel, Row, Stage
from gnss_hil.emulator.error_models.params_receiver import ClockInstability
from gnss_hil.emulator.numerics.walk import Walk


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    walk: Walk

    def clocks(self, epochs: Epochs) -> F64:
        return np.stack(self.walk.over(epochs.first, epochs.count))


def build(params: ClockInstability, context: Context) -> ErrorModel:
    return Model(Walk(oscillator.running(params, context.seed, context.key, context.interval_ns)))


ROW = Row(
    "clock_instability",
    ClockInstability,
    Stage.OSCILLATOR,
    "van Dierendonck, McGraw & Brown, 16th PTTI (1984) 273",
    build,
)
