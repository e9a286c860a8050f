"""The clock that the time mark is read from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.clocks.onboard_clock import RandomWalk
from gnss_hil.emulator.error_models.base import Context, Epochs, Row, Stage
from gnss_hil.emulator.error_models.params import Factor


class OnboardClock(Factor):
    """The clock that the time mark is read from. Defaults are modelled: a quartz clock set to a microsecond.

    offset_us   at the start, ahead of GPS time where positive
    drift_ppb   rate, 1e-9, fast where positive
    walk        Allan deviation at 1 s of white noise of frequency; 0: none
    """

    offset_us: Annotated[float, Field(ge=-1e6, le=1e6)] = 1.0
    drift_ppb: Annotated[float, Field(ge=-1e5, le=1e5)] = 10.0
    walk: Annotated[float, Field(ge=0, le=1e-6)] = 1e-10


def offset_s(parameters: OnboardClock, t_s: float) -> float:
    """Offset and drift alone: clock minus GPS time [s], t_s after the start."""
    return 1e-6 * parameters.offset_us + 1e-9 * parameters.drift_ppb * t_s


def showing(parameters: OnboardClock, seed: int, craft_key: int, interval_ns: int) -> Callable[[int], float]:
    """The clock of a craft's computer: epoch -> clock minus GPS time [s]."""
    walk = RandomWalk(seed, craft_key)

    def computer_s(epoch: int) -> float:
        t_s = epoch * interval_ns / NS_PER_S
        wandered_s = parameters.walk * walk.at(t_s) if parameters.walk else 0.0
        return offset_s(parameters, t_s) + wandered_s

    return computer_s


@dataclass(frozen=True, slots=True)
class Model:
    """shown_s  epoch -> clock minus GPS time [s]."""

    shown_s: Callable[[int], float]

    def block(self, epochs: Epochs) -> F64:
        return np.array([self.shown_s(epoch) for epoch in epochs.number.tolist()])


def build(params: OnboardClock, context: Context) -> Model:
    return Model(showing(params, context.seed, context.key, context.interval_ns))


ROW = Row(
    "onboard_clock",
    OnboardClock,
    Stage.LATCH,
    "IEEE Std 1139-2008, annex B: walk of white frequency noise",
    build,
)
