"""Weights of measurements: the inverse of the covariance of what they err by, or its diagonal alone."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64


def weight(own: F64, common: F64) -> F64:
    """Of errors of which each measurement (n,) has its own, by their variances, and some (n, k) in common, by
    1 sigma of each: (n,) where there are none of these, else (n, n)."""
    if not common.size:
        return 1 / own
    # Woodbury's identity: as many unknowns as there are common errors, instead of measurements.
    scaled = common / own[:, None]
    inner = np.linalg.inv(np.eye(common.shape[1]) + common.T @ scaled)
    return np.diag(1 / own) - scaled @ inner @ scaled.T


def times(weight: F64, y: F64) -> F64:
    """A weight, (n, n) or (n,) its diagonal, times (n,) or (n, u)."""
    if weight.ndim == 2:
        return weight @ y
    return weight * y if y.ndim == 1 else weight[:, None] * y
