"""Thermal noise of a receiver's loops: what the rows for code, carrier and frequency have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models.base import CraftContext, PathModel, PathTerm, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.keyed_draws import Stream, normal
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops

Sigma = Callable[[ChannelGeometry, F64, Loops], F64]
"""Signals (p,), their C/N0 (p,) as a ratio [Hz], loops -> 1 sigma (p,) [m] or [m/s]."""


@dataclass(frozen=True, slots=True)
class Model(PathModel):
    """White noise of the given sigma, drawn for each signal and epoch; term: what of a signal it disturbs."""

    term: Literal["range_m", "phase_m", "rate_mps"]
    sigma: Sigma
    loops: Loops
    stream: Stream

    def block(self, at: ChannelGeometry) -> PathTerm:
        standard = normal(self.stream.of_signals(at.epoch, at.receiver, at.sat, at.signal))
        sigma = self.sigma(at, 10 ** (at.cn0_dbhz / 10), self.loops)
        return PathTerm(**{self.term: standard * sigma})


def row(
    name: str,
    params: type[Factor],
    term: Literal["range_m", "phase_m", "rate_mps"],
    sigma: Sigma,
    loop: str,
    shows: str,
) -> Row[PathModel]:
    """The row of a loop, on by default."""

    def build(params: Factor, context: CraftContext) -> PathModel:
        return Model(term, sigma, context.loops, context.stream(name))

    source = f"Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9: {loop} thermal noise"
    return Row(name, params, Stage.PATH, source, build, default=True, shows=shows)
