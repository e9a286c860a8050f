"""The error budget of ranges: what each errs by for itself, and what some of them have in common.

An error that several ranges have in common does not average out. A satellite's own is in the ranges of all
antennas that track it, a receiver's delay in all that it measures, the ionosphere, whose content is known to
a factor only, in all rays, in proportion to their ways through it. Such an error is a column: what each
range has of it at 1 sigma. The covariance of the ranges is that of their own errors on the diagonal and the
sum of the columns' squares; least squares by its inverse weighs ranges as if each common error were one more
unknown of a known size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.dbc.common.vehicle import ReceiverFigures
from gnss_hil.flightsw.measurement.ionosphere import Ionosphere, delay
from gnss_hil.flightsw.measurement.noise import ReceiverNoise, receiver_noise
from gnss_hil.flightsw.measurement.options import MeasurementOptions
from gnss_hil.flightsw.measurement.range_model import Rays
from gnss_hil.flightsw.measurement.satellite_shares import (
    SatelliteShares,
    none_shared,
    satellite_shares,
)
from gnss_hil.flightsw.measurement.weights import weight
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import ReceiverDelays


@dataclass(frozen=True, slots=True, eq=False)
class Budget:
    """What stays the same for a run.

    delay_m        1 sigma of a receiver's delay
    ura_scale      how much of what satellites' orbits and clocks err by counts
    range_sigma_m  1 sigma of every pseudorange, whatever else is said; 0: as else said
    """

    noise: ReceiverNoise
    delay_m: float
    ura_scale: float
    range_sigma_m: float


def budget_of(figures: ReceiverFigures, options: MeasurementOptions) -> Budget:
    # A stated sigma has nothing in common with others: no delay may be learnt from ranges weighed by it.
    delay_m = 0.0 if options.range_sigma_m else figures.delay_m
    return Budget(receiver_noise(figures), delay_m, options.ura_scale, options.range_sigma_m)


@dataclass(frozen=True, slots=True, eq=False)
class RangeErrors:
    """Of n ranges.

    own_m2       (n,) variance of each by itself
    sat_sigma_m  (n,) 1 sigma of what each has in common with all ranges of its satellite, and which these are
    common_m     (n, k) 1 sigma of k other errors that several have in common; without any, k is 0
    ionosphere   over the craft, with the ranges' share of it (n,); None where no range has any
    late_m       (n,) what is known of the delays of their receivers
    lever_m      (3, n) of their antennas, where the attitude is not quite known: by turned_rad, 1 sigma about
                 each axis
    """

    own_m2: F64
    sat_sigma_m: F64
    shares: SatelliteShares
    common_m: F64
    electrons: F64 | None = None
    ionosphere: Ionosphere | None = None
    late_m: F64 | float = 0.0
    lever_m: F64 | None = None
    turned_rad: float = 0.0

    @property
    def variance_m2(self) -> F64:
        """(n,) of each alone, without the ionosphere."""
        return self.own_m2 + self.sat_sigma_m**2 + (self.common_m**2).sum(axis=1)

    def along(self, rays: Rays) -> tuple[F64, F64]:
        """Along these rays: own_m2 (n,) and common_m (n, k) with what the ionosphere adds."""
        _, own_m2, common_m = self._along(rays)
        return own_m2, common_m

    def at(self, rays: Rays) -> tuple[F64 | float, F64]:
        """Along these rays: what is to be taken from the ranges (n,) [m], and their weight, the inverse of
        their covariance: (n,) where all errors are independent, else (n, n)."""
        delay_m, own_m2, common_m = self._along(rays)
        return delay_m, weight(own_m2, common_m)

    def _along(self, rays: Rays) -> tuple[F64 | float, F64, F64]:
        common_m = self.common_m
        if self.lever_m is not None:
            turning_m = self.turned_rad * np.cross(self.lever_m.T, rays.los.T)
            common_m = _side_by_side(common_m, turning_m)
        if self.ionosphere is None or self.electrons is None:
            own_m2, of_satellites_m = self.shares.split(self.own_m2, self.sat_sigma_m)
            return self.late_m, own_m2, _side_by_side(of_satellites_m, common_m)
        electrons = self.electrons
        found = delay(self.ionosphere, rays.antenna_m, rays.los, rays.distance_m)
        # Rays from one satellite to antennas metres apart go through the same electrons.
        sat_sigma_m = np.sqrt(self.sat_sigma_m**2 + electrons**2 * found.own_m2)
        own_m2, of_satellites_m = self.shares.split(self.own_m2, sat_sigma_m)
        in_common = (electrons * found.common_m)[:, None]
        late_m = self.late_m + electrons * found.modelled_m
        return late_m, own_m2, _side_by_side(of_satellites_m, common_m, in_common)


def independent(own_m2: F64) -> RangeErrors:
    """Of ranges that have nothing in common, with variances (n,)."""
    n = len(own_m2)
    return RangeErrors(own_m2, np.zeros(n), none_shared(n), np.zeros((n, 0)))


def _side_by_side(*columns: F64) -> F64:
    """(n, k) of all that have any."""
    some = [column for column in columns if column.size]
    return np.concatenate(some, axis=1) if len(some) > 1 else (some or columns)[0]


def range_errors(
    z: Ranges, budget: Budget, ionosphere: Ionosphere | None, delays: ReceiverDelays | None = None
) -> RangeErrors:
    """Of ranges (n rows).

    ionosphere   over the craft at this epoch, None where there is none
    delays       of the receivers; None: unknown
    """
    if not z.electrons.any():
        ionosphere = None
    if budget.range_sigma_m:
        equal = independent(np.full(len(z), budget.range_sigma_m**2))
        return replace(equal, electrons=z.electrons, ionosphere=ionosphere)
    space_m = budget.ura_scale * np.hypot(z.space_sigma_m, z.code_bias_sigma_m)
    common_m = np.zeros((len(z), 0))
    if budget.delay_m:
        # Of a receiver alone on its clock it is in the clock, and makes that less certain.
        root_m = budget.delay_m * np.eye(z.receiver.max(initial=0) + 1) if delays is None else delays.root_m
        common_m = root_m[z.receiver]
    late_m = 0.0 if delays is None else delays.mean_m[z.receiver]
    sat_sigma_m = np.hypot(space_m, z.followed_sigma_m)
    shares = satellite_shares(z.sat)
    return RangeErrors(z.code_variance_m2, sat_sigma_m, shares, common_m, z.electrons, ionosphere, late_m)
