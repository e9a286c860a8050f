"""Errors that all measurements of one satellite have alike, on whatever antenna: antennas are metres apart.

Of a satellite that one antenna alone has, such an error is one more of that measurement's own; of one that
several have it is a column of the covariance's root, which does not average out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.flightsw.records.ranges import distinct


@dataclass(frozen=True, slots=True, eq=False)
class SatelliteShares:
    """Of n measurements.

    several   (n,) whether another is of the same satellite
    columns   (n, k) one for each satellite that several have, 1 at its measurements
    """

    several: Bool
    columns: F64

    def split(self, own: F64, sigma: F64) -> tuple[F64, F64]:
        """Of measurements with variances (n,) of their own and 1 sigma (n,) of their satellites: variances
        (n,) of what each has by itself, and columns (n, k), 1 sigma of what several have in common."""
        if not self.columns.size:
            return own + sigma**2, self.columns
        return own + np.where(self.several, 0.0, sigma**2), self.columns * sigma[:, None]


def satellite_shares(sat: I64) -> SatelliteShares:
    """Of measurements of satellites (n,)."""
    if distinct(sat) == len(sat):
        return none_shared(len(sat))
    several = np.bincount(sat)[sat] > 1
    return SatelliteShares(several, (sat[:, None] == np.unique(sat[several])).astype(float))


def none_shared(n: int) -> SatelliteShares:
    """Of n measurements of as many satellites."""
    return SatelliteShares(np.zeros(n, bool), np.zeros((n, 0)))
