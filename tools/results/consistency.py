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
_LEAST_M, _LEAST_MPS = 0.01 / np.sqrt(12), 0.001 / np.sqrt(12)
"""What the steps of NAV_SIGMA and NAV_VSIGMA leave open: no deviation is taken for smaller."""


def nees(error: NDArray, sigma: NDArray, rho: NDArray) -> NDArray:
    """(n,) of errors (n, 3), deviations (n, 3) and correlations xy, xz, yz (n, 3); nan where something is
    missing or the three are no covariance."""
    covariance = sigma[:, :, None] * sigma[:, None, :]
    for k, (_, i, j) in enumerate(_PAIRS):
        covariance[:, i, j] *= rho[:, k]
        covariance[:, j, i] *= rho[:, k]
    out = np.full(len(error), np.nan)
    whole = np.concatenate((covariance.reshape(len(error), 9), error), axis=1)
    known = np.flatnonzero(np.isfinite(whole).all(axis=1))
    known = known[np.linalg.det(covariance[known]) > 0]
    solved = np.linalg.solve(covariance[known], error[known][:, :, None])[:, :, 0]
    out[known] = (error[known] * solved).sum(axis=1)
    return out


def position_nees(fixes: Mapping[str, NDArray], error_m: NDArray) -> NDArray:
    """(n,) of fixes with errors (n, 3)."""
    sigma = np.column_stack([fixes[f"sigma_{a}_m"] for a in "xyz"])
    rho = np.column_stack([fixes[f"rho_{pair}"] for pair, _, _ in _PAIRS])
    return nees(error_m, np.maximum(sigma, _LEAST_M), rho)


def velocity_nees(fixes: Mapping[str, NDArray], error_mps: NDArray) -> NDArray:
    """(n,) of fixes with errors (n, 3)."""
    sigma = np.column_stack([fixes[f"sigma_v{a}_mps"] for a in "xyz"])
    rho = np.column_stack([fixes[f"rho_v{pair}"] for pair, _, _ in _PAIRS])
    return nees(error_mps, np.maximum(sigma, _LEAST_MPS), rho)


def clock_of_fix(fixes: Mapping[str, NDArray], clock: NDArray) -> NDArray:
    """(n,) of clocks (n, domains): the one whose bias each fix has, nan where it has none."""
    domain = fixes["clock_domain"]
    has = np.isfinite(domain) & (domain < clock.shape[1])
    row, column = np.arange(len(domain)), np.where(has, domain, 0).astype(np.intp)
    return np.where(has, clock[row, column], np.nan)


def clock_nees(fixes: Mapping[str, NDArray], clock_m: NDArray) -> NDArray:
    """(n,) of the bias of a fix's lowest clock domain against the truth (n,) [m]; 1 on the mean."""
    return ((fixes["clock_bias_m"] - clock_m) / fixes["sigma_clock_bias_m"]) ** 2
