"""The correlation function of a ranging code, as far as multipath needs it: unit chips, random code.

Side lobes of real codes (-24 dB for C/A) are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64

Correlation = Callable[[F64], F64]
"""Correlation by delay [chips], 1 at zero."""

_STEP_CHIPS = 1 / 256
_REACH_CHIPS = 6.0
_FREQUENCIES = 4001


def triangle(delay_chips: F64) -> F64:
    """Of rectangular chips through an infinitely wide front end."""
    return np.maximum(1 - np.abs(delay_chips), 0.0)


@lru_cache(maxsize=16)
def band_limited(bandwidth_chips: float) -> Correlation:
    """Of rectangular chips through an ideal band pass.

    bandwidth_chips   two-sided bandwidth as a multiple of the chipping rate
    The transform of sinc^2, the spectrum of rectangular chips, inside the band; table, linear between its
    points, which costs 5e-5 at most. Source: Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 2.4
    """
    delay = np.arange(0, _REACH_CHIPS, _STEP_CHIPS)
    frequency = np.linspace(0, bandwidth_chips / 2, _FREQUENCIES)
    density = np.sinc(frequency) ** 2
    waves = np.cos(2 * np.pi * delay[:, None] * frequency)
    table = np.asarray(np.trapezoid(density * waves, frequency, axis=1))
    table /= table[0]

    def correlate(delay_chips: F64) -> F64:
        place = np.abs(delay_chips) / _STEP_CHIPS
        left = np.minimum(place.astype(np.int64), len(table) - 2)
        share = np.minimum(place - left, 1.0)
        return table[left] + share * (table[left + 1] - table[left])

    return correlate
