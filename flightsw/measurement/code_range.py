"""Pseudoranges as measurements: geometric range, clocks, time offsets of systems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.measurement import range_model
from gnss_hil.flightsw.measurement.base import Point, Unknown
from gnss_hil.flightsw.measurement.budget import RangeErrors
from gnss_hil.flightsw.measurement.range_model import Rays
from gnss_hil.flightsw.records.ranges import Ranges


@dataclass(frozen=True, slots=True, eq=False)
class CodeRanges:
    """Steps 4 and 10 of RU 2706636 C1: the spheres.

    value      (n,) pseudoranges with the satellites' clocks added [m]
    errors     what they are known to err by
    pos_sv_m   (3, n) satellites, ECEF of the transmission instants
    lever_m    (3, n) antennas relative to the centre of mass, ECEF
    clocks     (n, c) 1 where a clock or time offset is part of a range, else 0
    """

    kind: ClassVar[str] = "code"
    unknowns: ClassVar[tuple[Unknown, ...]] = (Unknown.POSITION, Unknown.CLOCK)
    value: F64
    errors: RangeErrors
    pos_sv_m: F64
    lever_m: F64
    clocks: F64

    @property
    def variance(self) -> F64:
        """(n,) [m^2] of each alone, without the ionosphere."""
        return self.errors.variance_m2

    def rays(self, position_m: F64) -> Rays:
        """From the satellites to the antennas of a craft at position_m (3,)."""
        return range_model.rays(self.pos_sv_m, self.lever_m + position_m[:, None])

    def design(self, rays: Rays) -> F64:
        """(n, 3 + c) Jacobian along these rays."""
        design = np.empty((len(self.value), 3 + self.clocks.shape[1]))
        design[:, :3] = -rays.los.T
        design[:, 3:] = self.clocks
        return design

    def predict(self, x: Point) -> F64:
        range_m = self.rays(x.position_m).range_m
        return range_m if x.clock_m is None else range_m + self.clocks @ x.clock_m

    def jacobian(self, x: Point) -> F64:
        return self.design(self.rays(x.position_m))


def code_ranges(m: Ranges, lever_m: F64, clocks: F64, errors: RangeErrors) -> CodeRanges:
    """Of ranges (n rows) with lever arms (3, n), clock columns (n, c) and what they err by."""
    return CodeRanges(m.pseudorange_m + m.clock_m, errors, m.pos_sv_m, lever_m, clocks)
