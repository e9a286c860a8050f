"""Weighted least squares for a handful of unknowns, with the judgement whether they are observable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64

LEAST_PIVOT = 1e-9
"""Smallest squared Cholesky pivot of the normal matrix scaled to a unit diagonal. A pivot is what is left of
an unknown's column once the columns before it are taken out, as a share of the column; with n measurements
and a dilution P it is of the order 1 / (n P^2), so this is beyond any dilution worth publishing."""


_TINY = np.finfo(float).tiny
_EYE = np.eye(16)


@dataclass(frozen=True, slots=True)
class Estimate:
    """x (u,), its covariance (u, u) for the weights given, and the unweighted cofactor (u, u).

    weighted   (u, n) the design's transpose times the weights
    gain       (u, n) dx/dy
    """

    x: F64
    covariance: F64
    cofactor: F64
    weighted: F64

    @property
    def gain(self) -> F64:
        return self.covariance @ self.weighted


def least_squares(design: F64, y: F64, weight: F64) -> Estimate | None:
    """Minimise sum weight (y - design x)^2; None if the unknowns are not observable.

    design (n, u), y (n,), weight (n,) = 1 / variance. Normal equations scaled to a unit diagonal, by
    Cholesky; the weighted and the unweighted system go through LAPACK together.
    """
    unknowns = design.shape[1]
    if len(y) < unknowns:
        return None
    weighted = design.T * weight
    normal = np.array((weighted @ design, design.T @ design))
    scale = 1 / np.sqrt(np.maximum(_diagonals(normal), _TINY))
    try:
        lower: F64 = np.linalg.cholesky(normal * scale[:, :, None] * scale[:, None, :]).astype(
            np.float64, copy=False
        )
    except np.linalg.LinAlgError:
        return None
    if not _diagonals(lower).min() ** 2 >= LEAST_PIVOT:
        return None
    # L^-1 S: its Gram matrix is the covariance.
    factor = np.linalg.solve(lower, scale[:, None, :] * _EYE[:unknowns, :unknowns])
    covariance, cofactor = factor.transpose(0, 2, 1) @ factor
    return Estimate(covariance @ (weighted @ y), covariance, cofactor, weighted)


def adjusted(design: F64, y: F64, weight: F64) -> F64:
    """The x (u,) alone, for unknowns already known to be observable."""
    weighted = design.T * weight
    return np.asarray(np.linalg.solve(weighted @ design, weighted @ y), np.float64)


def _diagonals(square: F64) -> F64:
    """(k, u) view of the diagonals of (k, u, u)."""
    return square.reshape(len(square), -1)[:, :: square.shape[-1] + 1]
