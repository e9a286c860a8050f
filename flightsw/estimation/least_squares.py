"""Weighted least squares for a handful of unknowns, with the judgement whether they are observable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Index
from gnss_hil.flightsw.measurement.weights import times

LEAST_PIVOT = 1e-9
"""Smallest share that must be left of an unknown's column once the columns of all others are taken out. It is
1 / (N_ii (N^-1)_ii) of the normal matrix N, whatever the columns' scale: the last squared Cholesky pivot of N
scaled to a unit diagonal, with that unknown ordered last. With n measurements and a dilution P it is of the
order 1 / (n P^2), so this is beyond any dilution worth publishing."""


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
    """Minimise (y - design x)' weight (y - design x); None if the unknowns are not observable.

    design (n, u), y (n,); weight the inverse of the covariance of y, (n, n), or (n,) its diagonal. Normal
    equations by their inverse, which is wanted anyhow: the weighted and the unweighted one go through LAPACK
    together.
    """
    if len(y) < design.shape[1]:
        return None
    weighted = times(weight, design).T
    normal = np.array((weighted @ design, design.T @ design))
    try:
        inverse: F64 = np.linalg.inv(normal).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        return None
    inverse_pivots = (normal * inverse).diagonal(axis1=1, axis2=2)
    # What rounding makes of a singular matrix may also be negative or no number.
    if not all(0 < p <= 1 / LEAST_PIVOT for p in inverse_pivots.ravel().tolist()):
        return None
    covariance, cofactor = inverse
    return Estimate(covariance @ (weighted @ y), covariance, cofactor, weighted)


def scattered(values: F64, rows: Index, n: int, fill: float) -> F64:
    """(..., n) with values (..., k) in rows (k,) and `fill` elsewhere."""
    if len(rows) == n:
        return values
    out = np.full((*values.shape[:-1], n), fill)
    out[..., rows] = values
    return out
