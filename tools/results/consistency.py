"""Are fixes as wrong as they say? Errors by the covariance that was published with them.

The normalised squared error e' P^-1 e of a covariance that is true is 3 on the mean, for three axes; below,
the flight software is too cautious, above, it promises too much. Source: Bar-Shalom, Li & Kirubarajan,
Estimation with Applications to Tracking and Navigation (2001), 5.4 (NEES)
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

_PAIRS = (("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
_LEAST_M, _LEAST_MPS, _LEAST_CLOCK_M = 0.01 / np.sqrt(12), 0.001 / np.sqrt(12), 0.001 / np.sqrt(12)
"""What the steps of NAV_SIGMA, NAV_VSIGMA and NAV_CLOCK_SIGMA leave open: none is taken for smaller."""

_MOST_M, _MOST_MPS, _MOST_CLOCK_M = 655.35, 65.535, 16_777.215
"""Where they saturate: nobody knows by how much a deviation was larger."""

_LEAST_SHARE = 1e-3
"""Of correlations the least eigenvalue that their steps of 1e-4 leave known, to a tenth. Along its axis a
position is known 30 times better than across, and what was published does not say how much better."""


def nees(error: NDArray, sigma: NDArray, rho: NDArray) -> NDArray:
    """(n,) of errors (n, 3), deviations (n, 3) and correlations xy, xz, yz (n, 3); nan where something is
    missing or what was published is no covariance, or none to the last digit."""
    unit = np.tile(np.eye(3), (len(error), 1, 1))
    for k, (_, i, j) in enumerate(_PAIRS):
        unit[:, i, j] = unit[:, j, i] = rho[:, k]
    out = np.full(len(error), np.nan)
    whole = np.concatenate((error, sigma, rho), axis=1)
    known = np.flatnonzero(np.isfinite(whole).all(axis=1))
    known = known[np.linalg.eigvalsh(unit[known])[:, 0] >= _LEAST_SHARE]
    scaled = error[known] / sigma[known]
    solved = np.linalg.solve(unit[known], scaled[:, :, None])[:, :, 0]
    out[known] = (scaled * solved).sum(axis=1)
    return out


def _within(sigma: NDArray, least: float, most: float) -> NDArray:
    """Deviations as published, nan where they are saturated."""
    return np.where(sigma < most, np.maximum(sigma, least), np.nan)


def position_nees(fixes: Mapping[str, NDArray], error_m: NDArray) -> NDArray:
    """(n,) of fixes with errors (n, 3)."""
    sigma = np.column_stack([fixes[f"sigma_{a}_m"] for a in "xyz"])
    rho = np.column_stack([fixes[f"rho_{pair}"] for pair, _, _ in _PAIRS])
    return nees(error_m, _within(sigma, _LEAST_M, _MOST_M), rho)


def velocity_nees(fixes: Mapping[str, NDArray], error_mps: NDArray) -> NDArray:
    """(n,) of fixes with errors (n, 3)."""
    sigma = np.column_stack([fixes[f"sigma_v{a}_mps"] for a in "xyz"])
    rho = np.column_stack([fixes[f"rho_v{pair}"] for pair, _, _ in _PAIRS])
    return nees(error_mps, _within(sigma, _LEAST_MPS, _MOST_MPS), rho)


def clock_of_fix(fixes: Mapping[str, NDArray], clock: NDArray) -> NDArray:
    """(n,) of clocks (n, domains): the one whose bias each fix has, nan where it has none."""
    domain = fixes["clock_domain"]
    has = np.isfinite(domain) & (domain < clock.shape[1])
    row, column = np.arange(len(domain)), np.where(has, domain, 0).astype(np.intp)
    return np.where(has, clock[row, column], np.nan)


def clock_nees(fixes: Mapping[str, NDArray], clock_m: NDArray) -> NDArray:
    """(n,) of the bias of a fix's lowest clock domain against the truth (n,) [m]; 1 on the mean."""
    sigma_m = _within(fixes["sigma_clock_bias_m"], _LEAST_CLOCK_M, _MOST_CLOCK_M)
    return ((fixes["clock_bias_m"] - clock_m) / sigma_m) ** 2
