"""Free oscillators in place of the bounded wander, one for each clock domain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.clocks import oscillator
from gnss_hil.emulator.clocks.bounded_wander import DOMAINS
from gnss_hil.emulator.error_models.base import Context, Epochs, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.numerics.recursion import Recursion


class ClockInstability(Factor):
    """Free oscillators in place of the bounded wander, one for each clock domain.

    oscillator     class: see `gnss_hil.emulator.clocks.oscillator.OSCILLATORS`
    offset_ms      1 sigma of the time error at the start (modelled)
    frequency_ppb  1 sigma of the frequency error at the start, 1e-9 (modelled)
    reset_ms       a clock more than half of this off is set back by it; 0: never
    """

    oscillator: Literal["tcxo-low", "tcxo", "ocxo", "csac", "rb"] = "tcxo"
    offset_ms: Annotated[float, Field(ge=0, le=10)] = 0.1
    frequency_ppb: Annotated[float, Field(ge=0, le=2000)] = 20.0
    reset_ms: Annotated[float, Field(ge=0, le=100)] = 0.0


def switched_on(parameters: ClockInstability, standard: F64) -> F64:
    """Clocks (2, c) at the start of a run from (c, 2) standard normal numbers."""
    return standard.T * np.array(((1e-3 * parameters.offset_ms,), (1e-9 * parameters.frequency_ppb,)))


def running(
    parameters: ClockInstability, seed: int, craft_key: int, interval_ns: int
) -> Callable[[F64 | None, int], F64]:
    """The oscillators of a craft's clock domains; receivers of one domain share one."""
    kind = oscillator.OSCILLATORS[parameters.oscillator]
    step_s, dt_s = 1e-3 * parameters.reset_ms, interval_ns / NS_PER_S
    draws = Stream(seed, craft_key, "clock_instability")

    def clocks(before: F64 | None, epoch: int) -> F64:
        standard = draws.normal_of_epoch(epoch, 2 * DOMAINS).reshape(DOMAINS, 2)
        if before is None:
            state = switched_on(parameters, standard)
        else:
            state = oscillator.advance(kind, before, standard, dt_s)
        return oscillator.reset(state, step_s) if step_s else state

    return clocks


@dataclass(frozen=True, slots=True)
class Model:
    states: Recursion

    def block(self, epochs: Epochs) -> F64:
        return np.stack(self.states.over(epochs.first, epochs.count))


def build(params: ClockInstability, context: Context) -> Model:
    return Model(Recursion(running(params, context.seed, context.key, context.interval_ns)))


ROW = Row(
    "clock_instability",
    ClockInstability,
    Stage.OSCILLATOR,
    "van Dierendonck, McGraw & Brown, 16th PTTI (1984) 273",
    build,
)
