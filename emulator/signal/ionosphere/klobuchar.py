"""Vertical electron content by the model whose coefficients GPS broadcasts.

Source: IS-GPS-200, 20.3.3.5.2.5 and figure 20-4, after J. A. Klobuchar, IEEE Trans. AES 23 (1987) 325
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Floats

NIGHT_S = 5e-9
_PEAK_S, _DAY_S, _SHORTEST_S = 50_400.0, 86_400.0, 72_000.0
_LAST_LATITUDE = 0.416
_SEMICIRCLE = np.pi
_LAST_PHASE = np.sqrt(6 - np.sqrt(12))
"""1.5925 rad, where 1 - x^2/2 + x^4/24 is zero."""


@dataclass(frozen=True, slots=True)
class Coefficients:
    """alpha (4,) [s, s/semicircle ...] of the amplitude, beta (4,) [s, ...] of the period."""

    alpha: tuple[float, ...]
    beta: tuple[float, ...]


_STEPS = {"alpha": (2.0**-30, 2.0**-27, 2.0**-24, 2.0**-24), "beta": (2.0**11, 2.0**14, 2.0**16, 2.0**16)}
"""Of the message's eight bits. IS-GPS-200, table 20-X."""


def as_broadcast(coefficients: Coefficients) -> Coefficients:
    """In the steps and bounds of the message."""

    def eight_bits(name: str) -> tuple[float, ...]:
        pairs = zip(getattr(coefficients, name), _STEPS[name], strict=True)
        return tuple(step * min(max(round(value / step), -128), 127) for value, step in pairs)

    return Coefficients(eight_bits("alpha"), eight_bits("beta"))


def vertical_delay_s(coefficients: Coefficients, second_of_day: Floats, lat_rad: F64, lon_rad: F64) -> F64:
    """Vertical delay on GPS L1 [s] over a place; arrays that broadcast.

    second_of_day  GPS time within the day [s]
    lat_rad, lon_rad   the place under the point of the ray [rad]

    Two steps of the letter are taken out, since a craft would meet them as jumps: the series of the
    cosine ends at its zero, 1.5925, not at 1.57 (there 2.1 % of the amplitude is left); local time counts
    to both sides of 14 h and not from midnight to midnight (which matters for periods above 142,000 s).
    Everywhere else it is the letter. Left are the point of the pole, and kinks where latitude, amplitude
    and period meet their bounds.
    """
    lat = np.minimum(np.maximum(lat_rad / _SEMICIRCLE, -_LAST_LATITUDE), _LAST_LATITUDE)
    lon = lon_rad / _SEMICIRCLE
    magnetic = lat + 0.064 * np.cos(lon_rad - 1.617 * _SEMICIRCLE)
    after_peak = 43_200.0 * lon + (second_of_day - _PEAK_S)
    after_peak -= _DAY_S * np.rint(after_peak / _DAY_S)
    period = np.maximum(_cubic(coefficients.beta, magnetic), _SHORTEST_S)
    amplitude = np.maximum(_cubic(coefficients.alpha, magnetic), 0.0)
    square = np.square(np.minimum(2 * np.pi * np.abs(after_peak) / period, _LAST_PHASE))
    return NIGHT_S + amplitude * (1 - square * (0.5 - square / 24))


def _cubic(c: tuple[float, ...], x: F64) -> F64:
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]))
