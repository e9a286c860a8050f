"""Ranges that no orbit explains: left out where a fit of all leads nowhere.

Least squares that are iterated find their way from thousands of kilometres of error, and what is wrong is
then excluded by its residual; a range that is wrong by more than an orbit is wide leads them astray for good.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool

WIDEST_M = 6e7
"""So far from the middle of the others may a range be: between satellites overhead and beyond the Earth, for
a craft as high as any that is navigated."""

NEAR_M = 1e5
"""So far, where it is known where the craft is: its orbit after an hour without a fix."""

_LEAST = 3
"""Of fewer ranges on a clock none is in the middle."""


def plausible(value_m: F64, expected_m: F64 | None, domain: I64) -> Bool:
    """(n,) ranges that are near the middle of those by the same clock.

    value_m     (n,) pseudoranges with the satellites' clocks added
    expected_m  (n,) from where the craft should be, None where that is not known
    domain      (n,) clock domain
    """
    misfit_m = value_m if expected_m is None else value_m - expected_m
    limit_m = WIDEST_M if expected_m is None else NEAR_M
    near = np.ones(len(value_m), bool)
    for clock in np.unique(domain):
        rows = domain == clock
        if np.count_nonzero(rows) >= _LEAST:
            near[rows] = np.abs(misfit_m[rows] - np.median(misfit_m[rows])) <= limit_m
    return near
