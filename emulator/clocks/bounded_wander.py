"""Receiver oscillators: a bounded wander, its phase drawn for each clock domain.

Modelled: a slow sine stands for the wander of a free oscillator that the receiver keeps within bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.numerics import keyed_draws

DOMAINS = 8

ClockState = F64
"""(2, DOMAINS) clocks minus GPS time [s] and their rates [s/s]."""

Clocks = Callable[[ClockState | None, int], ClockState]
"""The state of a craft's clocks in an epoch from that in the one before, None before the first."""


@dataclass(frozen=True, slots=True, eq=False)
class Wander:
    """amplitude_s [s], rate_radps [rad/s], phase_rad (8,) by clock domain."""

    amplitude_s: float
    rate_radps: float
    phase_rad: F64


def offset_s(wander: Wander, t_s: float | F64) -> tuple[F64, F64]:
    """Clock minus GPS time (8,) [s] by domain, t_s after the start, and its rate (8,) [s/s]."""
    angle = wander.rate_radps * t_s + wander.phase_rad
    return wander.amplitude_s * np.sin(angle), wander.amplitude_s * wander.rate_radps * np.cos(angle)


def phases_rad(seed: int, craft_key: int) -> F64:
    """(8,) by clock domain, each drawn at a place of its own: the first of four words of a counter."""
    generator = np.random.Philox(key=(seed, craft_key), counter=(0, 0, 1, 0))
    return 2 * np.pi * keyed_draws.uniform(generator.random_raw(4 * DOMAINS)[::4])


def over(wander: Wander, t_s: F64) -> F64:
    """Offsets [s] and rates [s/s] (k, 2, 8) at times (k,) after the start."""
    return np.stack(offset_s(wander, t_s[:, None]), axis=1)


def fastest(wander: Wander) -> float:
    """Largest rate of the clock [s/s]."""
    return wander.amplitude_s * wander.rate_radps
