"""Loops that slip a cycle or lose a signal, from C/N0 and bandwidth.

Slips are those of a loop of first order without a steady error, for which the mean time is known exactly;
other orders slip somewhat more often (modelled). A Costas loop tracks twice the phase, so that its stable
points lie half a cycle apart and noise weighs double.

Sources: Viterbi, Proc. IEEE 51 (1963) 1737 (Principles of Coherent Communication, 1966, 4.4);
Holmes, Coherent Spread Spectrum Systems (1982), 5;
Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9 (thresholds)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.emulator.error_models.params_receiver import CycleSlips, LossOfLock
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.signal.loops import Loops, carrier_sigma_rad, code_sigma_chips

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOST_JITTER_RAD = np.deg2rad(45.0)
"""Three sigma of a Costas loop's phase, and its steady error, that it still holds."""


def slip_rate_hz(snr: Array, bandwidth_hz: float) -> Array:
    """Slips a second, to either side, of a first-order loop without steady error.

    snr           of the loop: one over the variance of its phase [rad^2] as linear theory has it
    bandwidth_hz  one-sided noise bandwidth
    The inverse of the mean time to the first slip, pi^2 snr I0(snr)^2 / (2 B). Viterbi (1963)
    """
    from scipy.special import i0e

    return 2 * bandwidth_hz / (np.pi**2 * snr) * np.exp(-2 * snr) / i0e(snr) ** 2


def slips(
    parameters: CycleSlips, loops: Loops, raw: NDArray[np.uint64], cn0_dbhz: Array, dt_s: float
) -> NDArray[np.int64]:
    """Half cycles (p,) by which carrier phases slip in an epoch: 0, or 1 (Costas) or 2 to either side.

    raw  (p,) random words;  cn0_dbhz (p,);  dt_s length of the epoch
    """
    order = 2 if parameters.costas else 1
    snr = 1 / (order * _jitter_rad(loops, 10 ** (cn0_dbhz / 10))) ** 2
    rate_hz = slip_rate_hz(snr, loops.carrier_bandwidth_hz) + parameters.per_hour / 3600
    slipped = keyed_draws.uniform(raw) < -np.expm1(-rate_hz * dt_s)
    # `uniform` leaves out the lowest bits: the last one tells the side.
    side = 1 - 2 * (raw & np.uint64(1)).astype(np.int64)
    return np.where(slipped, side * (2 // order), 0)


def holds(parameters: LossOfLock, loops: Loops, cn0_dbhz: Array) -> Flags:
    """Whether both loops hold signals of this C/N0, any shape.

    Carrier: 3 sigma of all jitter and the steady error stay within 45 deg. Code: 3 sigma and the steady error
    stay within half the spacing of the correlators.
    """
    cn0_hz = 10 ** (cn0_dbhz / 10)
    phase = 3 * _jitter_rad(loops, cn0_hz) + np.deg2rad(parameters.stress_deg) <= MOST_JITTER_RAD
    chips = 3 * code_sigma_chips(cn0_hz, loops) + parameters.stress_chips
    return phase & (chips <= loops.correlator_spacing_chips / 2)


def _jitter_rad(loops: Loops, cn0_hz: Array) -> Array:
    """1 sigma of a carrier loop, noise and all else."""
    return np.hypot(carrier_sigma_rad(cn0_hz, loops), np.deg2rad(loops.other_jitter_deg))
