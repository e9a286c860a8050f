"""The clock that the time mark is read from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.clocks import onboard_clock
from gnss_hil.emulator.error_models.base import Context, Epochs, ErrorModel, Row, Stage
from gnss_hil.emulator.error_models.params_onboard import OnboardClock


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    """shown_s  epoch -> clock minus GPS time [s]."""

    shown_s: Callable[[int], float]

    def ahead_s(self, epochs: Epochs) -> F64:
        return np.array([self.shown_s(epoch) for epoch in epochs.number.tolist()])


def build(params: OnboardClock, context: Context) -> ErrorModel:
    return Model(onboard_clock.showing(params, context.seed, context.key, context.interval_ns))


ROW = Row(
    "onboard_clock",
    OnboardClock,
    Stage.LATCH,
    "IEEE Std 1139-2008, annex B: walk of white frequency noise",
    build,
)
