"""Free oscillators: two states, driven by white noise of frequency and by a random walk of frequency.

The time error of an oscillator grows with its frequency error and with white noise of frequency, density h0 /
2; its frequency error is a random walk, density 2 pi^2 h-2. What happens between two instants is drawn with
the exact covariance of both, so that the length of a step does not matter. Flicker of frequency has no finite
state and is left out (modelled): near the floor of their Allan deviation, real oscillators are worse.

Source: Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering, 4th ed., 9.3;
van Dierendonck, McGraw & Brown, "Relationship between Allan variances and Kalman filter parameters",
16th PTTI (1984) 273
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.registry import table
from gnss_hil.emulator.clocks.bounded_wander import ClockState


@dataclass(frozen=True, slots=True)
class Oscillator:
    """Densities of fractional frequency: h0 white [s], hm2 random walk [1/s] (h-2)."""

    name: str
    h0: float
    hm2: float
    source: str


_BROWN_HWANG = "Brown & Hwang, 4th ed., table 9.3, as quoted in open navigation software"

OSCILLATORS = table(
    Oscillator("tcxo-low", 2e-19, 2e-20, _BROWN_HWANG),
    Oscillator("tcxo", 2e-21, 2e-20, _BROWN_HWANG),
    Oscillator("ocxo", 2e-25, 6e-25, _BROWN_HWANG),
    Oscillator(
        "csac", 1.8e-19, 1.8e-28,
        "Microchip SA.45s data sheet: 3e-10 at 1 s, ageing below 3e-10 a month; h-2 modelled, 1e-11 a day",
    ),
    Oscillator("rb", 2e-22, 1e-30, _BROWN_HWANG),
)  # fmt: skip


def spread(white: float, walk: float, dt_s: float) -> F64:
    """What a step adds: lower triangle (2, 2) that makes time [s] and frequency errors of two standard
    normal numbers.

    white  density of white noise of frequency [s], h0 / 2
    walk   density of what drives the frequency [1/s], 2 pi^2 h-2
    Its square is ((white dt + walk dt^3 / 3, walk dt^2 / 2), (walk dt^2 / 2, walk dt)).
    """
    # Frequency first: its error is one number, and half of its step is in the time error.
    frequency = np.sqrt(walk * dt_s)
    return np.array(
        ((np.sqrt(white * dt_s + walk * dt_s**3 / 12), 0.5 * dt_s * frequency), (0.0, frequency)),
    )


def advance(oscillator: Oscillator, state: ClockState, standard: F64, dt_s: float) -> ClockState:
    """Time errors [s] and frequency errors (2, c) of c oscillators dt_s later.

    standard  (c, 2) standard normal numbers
    """
    noise = spread(oscillator.h0 / 2, 2 * np.pi**2 * oscillator.hm2, dt_s) @ standard.T
    return np.stack((state[0] + dt_s * state[1], state[1])) + noise


def reset(state: ClockState, step_s: float) -> ClockState:
    """Clocks (2, c) set back by whole steps as soon as they are more than half of one off."""
    return np.stack((state[0] - step_s * np.rint(state[0] / step_s), state[1]))
