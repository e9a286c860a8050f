"""How electrons are spread over height: a Chapman layer, thinner below its peak, and a plasmasphere.

Alpha-Chapman: exp((1 - z - e^-z) / 2), z = (h - peak) / scale, with a scale of its own on each side; both
have value 1 and slope 0 at the peak. The plasmasphere sets in above the peak and decays slowly:
e^(-u/decay) - e^(-u/topside) with u = h - peak, so that the density has no step.
Sources: S. Chapman, Proc. Phys. Soc. 43 (1931) 26; layer and exponential plasmasphere: N. Jakowski, Proc. IGS
Analysis Center Workshop 1996. Both cited from memory; the integrals are checked by quadrature.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import overload

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Floats

MAPPED_TO_M = 20_200e3
"""Vertical content is what lies below the height of GPS, where those are who measure it."""

_CHAPMAN = np.sqrt(2 * np.pi * np.e)
"""Integral of an alpha-Chapman layer over all z: sqrt(2 pi e) = 4.133."""

_LOWEST = -4.0
"""z below which nothing is left (1e-11 of the peak) and e^-z would only grow."""


@dataclass(frozen=True, slots=True)
class Profile:
    """Heights and scales [m]; plasmasphere_share of the vertical content [-]."""

    peak_m: float
    bottomside_m: float
    topside_m: float
    plasmasphere_m: float
    plasmasphere_share: float

    @property
    def layer_m(self) -> float:
        """Content of the layer over its peak density [m]: the thickness of a slab that holds as much."""
        from scipy.special import erf

        inside = erf(np.sqrt(0.5))
        return float(_CHAPMAN * (self.topside_m * inside + self.bottomside_m * (1 - inside)))


@overload
def _plasmasphere_above(profile: Profile, above_m: float) -> float: ...
@overload
def _plasmasphere_above(profile: Profile, above_m: F64) -> F64: ...
def _plasmasphere_above(profile: Profile, above_m: Floats) -> Floats:
    """Share of the plasmasphere beyond a distance over the peak, of all up to infinity."""
    slow, fast = profile.plasmasphere_m, profile.topside_m
    return (slow * np.exp(-above_m / slow) - fast * np.exp(-above_m / fast)) / (slow - fast)


def share_above(profile: Profile, height_m: F64) -> F64:
    """Share of the vertical content (...,) that lies above a height (...,) [m], up to the height of GPS.

    Integral of alpha-Chapman above z: sqrt(2 pi e) erf(e^(-z/2) / sqrt 2).
    """
    from scipy.special import erf

    above = np.asarray(height_m, float) - profile.peak_m
    z = above / np.where(above < 0, profile.bottomside_m, profile.topside_m)
    inside = erf(np.exp(-np.maximum(z, _LOWEST) / 2) / np.sqrt(2))
    core = erf(np.sqrt(0.5))
    scaled = np.where(
        above < 0,
        profile.topside_m * core + profile.bottomside_m * (inside - core),
        profile.topside_m * inside,
    )
    end = _plasmasphere_above(profile, MAPPED_TO_M - profile.peak_m)
    plasma = (_plasmasphere_above(profile, np.maximum(above, 0)) - end) / (1 - end)
    layer = _CHAPMAN * scaled / profile.layer_m
    return (1 - profile.plasmasphere_share) * layer + profile.plasmasphere_share * np.maximum(plasma, 0)


def density_pm(profile: Profile, height_m: F64) -> F64:
    """Density (...,) at a height (...,) [m] over the vertical content [1/m]."""
    above = height_m - profile.peak_m
    below = above < 0
    fading = np.exp(-np.maximum(above / np.where(below, profile.bottomside_m, profile.topside_m), _LOWEST))
    # exp((1 - z - e^-z) / 2) without a third exponential of z.
    layer = np.sqrt(fading) * np.exp(0.5 - 0.5 * fading)
    end = _plasmasphere_above(profile, MAPPED_TO_M - profile.peak_m)
    slow, fast = profile.plasmasphere_m, profile.topside_m
    plasma = np.where(below, 0.0, np.exp(-np.maximum(above, 0.0) / slow) - fading) / (
        (slow - fast) * (1 - end)
    )
    share = profile.plasmasphere_share
    return (1 - share) / profile.layer_m * layer + share * plasma
