"""Tracking loops: of every channel a delay, a phase and a frequency lock loop, and their thermal noise by
C/N0.

Source of the formulas: Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9 (2nd ed., 5.6):
code loop early minus late, power discriminator, wide front end; Costas loop; frequency lock loop.
Errors of different epochs are independent: noise is white from epoch to epoch (modelled: loops of 0.5 Hz
and faster forget within a second). So it is right for intervals of 1 s and more; of closer epochs a real
loop repeats part of its error, and averages over them come out too good here.

Slips are those of a loop of first order without a steady error, for which the mean time is known exactly;
other orders slip somewhat more often (modelled). Sources: Viterbi, Proc. IEEE 51 (1963) 1737 (Principles of
Coherent Communication, 1966, 4.4); Holmes, Coherent Spread Spectrum Systems (1982), 5
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.vehicle import Strict


class Loops(Strict):
    """Of every channel: a delay lock loop, early minus late; a phase lock loop; a frequency lock loop.

    ..._bandwidth_hz          one-sided noise bandwidths
    correlator_spacing_chips  early to late
    integration_s             before the discriminators
    other_jitter_deg          1 sigma of what shakes the phase lock beside noise: vibration, oscillator. It
                              counts for slips and loss of lock (modelled)
    """

    code_bandwidth_hz: Annotated[float, Field(ge=0.001, le=50)] = 0.5
    carrier_bandwidth_hz: Annotated[float, Field(ge=0.001, le=100)] = 15.0
    frequency_bandwidth_hz: Annotated[float, Field(ge=0.001, le=100)] = 2.0
    correlator_spacing_chips: Annotated[float, Field(ge=0.05, le=1)] = 0.5
    integration_s: Annotated[float, Field(ge=0.001, le=1)] = 0.02
    other_jitter_deg: Annotated[float, Field(ge=0, le=45)] = 2.0


_TWO_PI = 2 * np.pi


def code_sigma_chips(cn0_hz: F64, loops: Loops) -> F64:
    """1 sigma of a delay lock loop [chips] by C/N0 as a ratio [Hz].

    sqrt(B D / (2 C/N0) (1 + 2 / ((2 - D) T C/N0)))
    """
    spacing = loops.correlator_spacing_chips
    squaring = 1 + 2 / ((2 - spacing) * loops.integration_s * cn0_hz)
    return np.sqrt(loops.code_bandwidth_hz * spacing / (2 * cn0_hz) * squaring)


def carrier_sigma_rad(cn0_hz: F64, loops: Loops) -> F64:
    """1 sigma of a Costas phase lock loop [rad]: sqrt(B / C/N0 (1 + 1 / (2 T C/N0)))."""
    return np.sqrt(loops.carrier_bandwidth_hz / cn0_hz * (1 + 1 / (2 * loops.integration_s * cn0_hz)))


def doppler_sigma_hz(cn0_hz: F64, loops: Loops) -> F64:
    """1 sigma of a frequency lock loop at high C/N0 [Hz]: sqrt(4 B / C/N0 (1 + 1 / (T C/N0))) / (2 pi T)."""
    squaring = 1 + 1 / (loops.integration_s * cn0_hz)
    return np.sqrt(4 * loops.frequency_bandwidth_hz / cn0_hz * squaring) / (_TWO_PI * loops.integration_s)


def jitter_rad(loops: Loops, cn0_hz: F64) -> F64:
    """1 sigma of a carrier loop, noise and all else."""
    return np.hypot(carrier_sigma_rad(cn0_hz, loops), np.deg2rad(loops.other_jitter_deg))


def slip_rate_hz(snr: F64, bandwidth_hz: float) -> F64:
    """Slips a second, to either side, of a first-order loop without steady error.

    snr           of the loop: one over the variance of its phase [rad^2] as linear theory has it
    bandwidth_hz  one-sided noise bandwidth
    The inverse of the mean time to the first slip, pi^2 snr I0(snr)^2 / (2 B). Viterbi (1963)
    """
    from scipy.special import i0e

    return 2 * bandwidth_hz / (np.pi**2 * snr) * np.exp(-2 * snr) / i0e(snr) ** 2
