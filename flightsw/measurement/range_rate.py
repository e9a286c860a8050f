"""Range rates as measurements: velocity and the rates of the clocks.

dP/dt = clock rate + rho' - satellite clock rate (1 - rho' / c), all by GPS time; linear in the unknowns along
rays that the position gives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.measurement import range_model
from gnss_hil.flightsw.measurement.base import Point, Unknown
from gnss_hil.flightsw.measurement.ionosphere import Delay
from gnss_hil.flightsw.measurement.range_model import Rays
from gnss_hil.flightsw.measurement.satellite_shares import SatelliteShares, satellite_shares
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS
from gnss_hil.flightsw.records.ranges import Ranges


@dataclass(frozen=True, slots=True, eq=False)
class RangeRates:
    """Along the rays of the position they were made for.

    value      (n,) range rates with the satellites' clock rates added [m/s]
    own        (n,) variance of each by itself [m^2/s^2]
    sat_sigma  (n,) 1 sigma of what each has in common with all of its satellite [m/s], and which these are
    common     (n, k) 1 sigma of k other errors that several have in common [m/s]
    still      (n,) what a craft with its centre of mass at rest and no clock rate would measure
    design     (n, 3 + c) Jacobian
    """

    kind: ClassVar[str] = "rate"
    unknowns: ClassVar[tuple[Unknown, ...]] = (Unknown.VELOCITY, Unknown.DRIFT)
    value: F64
    own: F64
    sat_sigma: F64
    shares: SatelliteShares
    still: F64
    design: F64
    common: F64

    @property
    def variance(self) -> F64:
        """(n,) [m^2/s^2] of each alone."""
        return self.own + self.sat_sigma**2 + (self.common**2).sum(axis=1)

    def errors(self) -> tuple[F64, F64]:
        """Variances (n,) of each by itself and (n, k) 1 sigma of all that several have in common."""
        own, of_satellites = self.shares.split(self.own, self.sat_sigma)
        return own, np.concatenate((of_satellites, self.common), axis=1)

    def without(self, advance: Delay, electrons: F64) -> RangeRates:
        """With the ionosphere's part taken out, which the carrier has the other way round than the code."""
        return replace(
            self,
            value=self.value + electrons * advance.modelled_m,
            sat_sigma=np.sqrt(self.sat_sigma**2 + electrons**2 * advance.own_m2),
            common=np.column_stack((self.common, electrons * advance.common_m)),
        )

    def predict(self, x: Point) -> F64:
        velocity = np.zeros(3) if x.velocity_mps is None else x.velocity_mps
        drift = np.zeros(self.design.shape[1] - 3) if x.drift_mps is None else x.drift_mps
        return self.still + self.design @ np.concatenate((velocity, drift))

    def jacobian(self, x: Point) -> F64:
        return self.design


def range_rates(m: Ranges, geometry: F64, rays: Rays, lever_rate_mps: F64) -> RangeRates:
    """Of ranges (n rows).

    geometry         (n, 3 + c) Jacobian of the code ranges along the same rays
    lever_rate_mps   (3, n) antennas relative to the centre of mass, ECEF
    """
    static, gain = range_model.rate_terms(rays, m.vel_sv_mps)
    stretch = 1 + m.clock_drift_mps / LIGHT_MPS
    gain = gain * stretch
    lever = range_model.dot(rays.los, lever_rate_mps)
    design = geometry.copy()
    design[:, :3] *= gain[:, None]
    value = m.range_rate_mps + m.clock_drift_mps
    still = stretch * static - gain * lever
    return RangeRates(
        value,
        m.rate_variance_m2ps2,
        m.sat_rate_sigma_mps,
        satellite_shares(m.sat),
        still,
        design,
        np.zeros((len(m), 0)),
    )
