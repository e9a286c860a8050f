"""Weighted fits by textbook formulas, to be judged."""

from __future__ import annotations

import numpy as np

from gnss_hil.flightsw.integrity.consistency import Trial


def trial_of(design, y, weight, known=None, offset=None):
    """A fit of y, and beside it what was known before of its first unknowns."""
    full = np.diag(weight) if weight.ndim == 1 else weight
    covariance = np.linalg.inv(design.T @ full @ design)
    x = covariance @ design.T @ full @ y
    trial = Trial(x, design, y - design @ x, weight, covariance)
    return trial if known is None else trial.beside(offset - x[: len(offset)], known)


def drawn_design(rng, n):
    """Of n ranges: lines of sight and a clock."""
    los = rng.normal(size=(n, 3))
    return np.column_stack((los / np.linalg.norm(los, axis=1)[:, None], np.ones(n)))
