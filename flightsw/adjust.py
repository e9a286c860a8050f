"""Weighted least squares for a handful of unknowns, with the judgement whether they are observable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEAST_PIVOT = 1e-9
"""Smallest squared Cholesky pivot of the normal matrix scaled to a unit diagonal. A pivot is what is left of
an unknown's column once the columns before it are taken out, as a share of the column; with n measurements
and a dilution P it is of the order 1 / (n P^2), so this is beyond any dilution worth publishing."""


@dataclass(frozen=True, slots=True)
class Solution:
    """Estimate x (u,), its covariance (u, u) for the weights given, and the unweighted cofactor (u, u)."""

    x: NDArray[np.float64]
    covariance: NDArray[np.float64]
    cofactor: NDArray[np.float64]


def least_squares(
    design: NDArray[np.float64], y: NDArray[np.float64], weight: NDArray[np.float64]
) -> Solution | None:
    """Minimise sum weight (y - design x)^2; None if the unknowns are not observable.

    design (n, u), y (n,), weight (n,) = 1 / variance. Normal equations scaled to a unit diagonal, by
    Cholesky; the weighted and the unweighted system go through LAPACK together.
    """
    unknowns = design.shape[1]
    if len(y) < unknowns:
        return None
    weighted = design.T * weight
    normal = np.empty((2, unknowns, unknowns))
    normal[0] = weighted @ design
    normal[1] = design.T @ design
    diagonal = np.einsum("kii->ki", normal)
    if not (diagonal > 0).all():
        return None
    scale = 1 / np.sqrt(diagonal)
    try:
        lower = np.linalg.cholesky(normal * (scale[:, :, None] * scale[:, None, :]))
    except np.linalg.LinAlgError:
        return None
    if (np.einsum("kii->ki", lower) ** 2).min() < LEAST_PIVOT:
        return None
    # L^-1 S: its Gram matrix is the covariance.
    factor = np.linalg.solve(lower, scale[:, None, :] * np.eye(unknowns))
    covariance, cofactor = factor.transpose(0, 2, 1) @ factor
    return Solution(covariance @ (weighted @ y), covariance, cofactor)
