"""Block 3 of RU 2706636 C1, steps 4 and 10: position from all tracked signals of all antennas.

Iterated weighted least squares of one epoch. Unknowns: the centre of mass, one clock for each clock domain
that measures, and the time offset of each system that can be told apart from them (`estimation.clocks`).
Velocity and clock rates follow from the range rates of the same channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Index
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.flightsw.estimation.clocks import clock_columns, is_offset
from gnss_hil.flightsw.estimation.least_squares import Estimate, least_squares
from gnss_hil.flightsw.estimation.velocity import velocity_and_drift
from gnss_hil.flightsw.integrity import exclusion
from gnss_hil.flightsw.integrity.exclusion import STRICT, Kept, Rules, Trial
from gnss_hil.flightsw.measurement.code_range import CodeRanges, code_ranges
from gnss_hil.flightsw.measurement.noise import range_variance_m2
from gnss_hil.flightsw.measurement.range_model import Rays
from gnss_hil.flightsw.measurement.range_rate import range_rates
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import MAX_PDOP, NoFix, SnapshotFix, carriable

MAX_ITERATIONS = 12
CONVERGED_M = 10.0
"""A step this short ends the iteration: what Gauss-Newton leaves is step^2 / (2 range), 5 um at 1e7 m, and
the Earth's turn during the flight, a millionth of the step."""

DIVERGED_M = 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Intersection:
    """Converged solution: geometry there, and what is left.

    items    (c,) of the clocks
    rays     from the satellites to the antennas where the craft is
    design   (n, 3 + c) Jacobian along them
    """

    position_m: F64
    clock_m: F64
    items: tuple[int, ...]
    estimate: Estimate
    design: F64
    rays: Rays
    residual_m: F64
    iterations: int


@dataclass(frozen=True, slots=True, eq=False)
class Offered:
    """Measurements offered to a fix with what belongs to each: lever_m, lever_rate_mps (3, n) of its antenna,
    domain (n,) of its clock."""

    ranges: Ranges
    lever_m: F64
    lever_rate_mps: F64
    domain: I64
    ura_scale: float

    def __len__(self) -> int:
        return len(self.ranges)

    def __getitem__(self, rows: Index) -> Offered:
        if len(rows) == len(self):
            return self
        lever_m, lever_rate_mps = self.lever_m[:, rows], self.lever_rate_mps[:, rows]
        return Offered(self.ranges[rows], lever_m, lever_rate_mps, self.domain[rows], self.ura_scale)


def intersect(z: CodeRanges, items: tuple[int, ...], start_m: F64) -> Intersection | NoFix:
    """Steps 4 and 10: the point on all spheres, searched from start_m (3,)."""
    weight = 1 / z.variance
    position = start_m
    for iteration in range(1, MAX_ITERATIONS + 1):
        rays = z.rays(position)
        design = z.design(rays)
        misfit = z.value - rays.range_m
        estimate = least_squares(design, misfit, weight)
        if estimate is None:
            return NoFix.SINGULAR_GEOMETRY
        step = estimate.x[:3]
        position = position + step
        length = sqrt(step @ step)
        if length < CONVERGED_M:
            residual = misfit - design @ estimate.x
            # The direction from 10 m aside costs 4 mm/s of velocity: rays from where the craft is.
            rays = rays.from_aside(step)
            return Intersection(
                position, estimate.x[3:], items, estimate, z.design(rays), rays, residual, iteration
            )
        if not length < DIVERGED_M:
            break
    return NoFix.NO_CONVERGENCE


def _trial(offered: Offered, start_m: F64) -> Trial[Intersection] | NoFix:
    """Intersection of all that is offered."""
    m = offered.ranges
    items, clocks = clock_columns(offered.domain, m.sat // NUMBERS)
    needed = 4 + sum(map(is_offset, items))
    if m.satellites < needed or len(m) < 3 + len(items):
        return NoFix.TOO_FEW_SATELLITES
    variance = range_variance_m2(m.code_variance_m2, m.ura, m.sat, offered.ura_scale)
    found = intersect(code_ranges(m, offered.lever_m, clocks, variance), items, start_m)
    if isinstance(found, NoFix):
        return found
    return Trial(found, found.design, found.residual_m, variance)


def _consistent(offered: Offered, start_m: F64, rules: Rules) -> Kept[Intersection] | NoFix:
    """Intersection of what agrees, or as the rules have it."""
    first = _trial(offered, start_m)
    if isinstance(first, NoFix):
        return first

    def refit(rows: Index) -> Trial[Intersection] | None:
        trial = _trial(offered[rows], start_m)
        return None if isinstance(trial, NoFix) else trial

    kept = exclusion.exclude(first, refit, offered.ranges.sat, rules)
    return NoFix.INCONSISTENT_RANGES if kept is None else kept


def _from_starts(offered: Offered, start_m: F64 | None, rules: Rules) -> Kept[Intersection] | NoFix:
    """From start_m if there is one; without it, or if it leads nowhere, from the Earth's centre."""
    if start_m is not None:
        kept = _consistent(offered, start_m, rules)
        if not isinstance(kept, NoFix) or kept is NoFix.TOO_FEW_SATELLITES:
            return kept
    return _consistent(offered, np.zeros(3), rules)


def solve(
    m: Ranges,
    lever_m: F64,
    lever_rate_mps: F64,
    domain: I64,
    start_m: F64 | None = None,
    ura_scale: float = 1.0,
    rules: Rules = STRICT,
) -> SnapshotFix | NoFix:
    """The fix of an epoch, or why there is none.

    m                         ranges offered, n rows
    lever_m, lever_rate_mps   (3, n) antenna relative to the centre of mass, Greenwich frame, and its rate
    domain                    (n,) clock domain
    start_m                   (3,) where to start; without it, or if it leads nowhere, the Earth's centre
    ura_scale                 how much of the broadcast URA counts in the weights
    rules                     what becomes of measurements that disagree
    """
    offered = Offered(m, lever_m, lever_rate_mps, domain, ura_scale)
    kept = _from_starts(offered, start_m, rules)
    if isinstance(kept, NoFix):
        return kept
    found, rows = kept.trial.found, kept.rows
    pdop = sqrt(sum(found.estimate.cofactor.diagonal()[:3].tolist()))
    if pdop > MAX_PDOP:
        return NoFix.SINGULAR_GEOMETRY
    if not carriable(found.position_m, found.clock_m):
        return NoFix.NO_CONVERGENCE
    used = offered[rows]
    rates = range_rates(used.ranges, found.design, found.rays, used.lever_rate_mps)
    velocity, drift = velocity_and_drift(rates, used.ranges.sat, rules)
    among_offered = np.zeros(len(m), bool)
    among_offered[rows] = True
    return SnapshotFix(
        position_m=found.position_m,
        velocity_mps=velocity,
        items=found.items,
        clock_m=found.clock_m,
        drift_mps=drift,
        covariance_m2=found.estimate.covariance[:3, :3],
        gain=_scattered(found.estimate.gain[:3], rows, len(m), 0.0),
        pdop=pdop,
        used=among_offered,
        satellites=used.ranges.satellites,
        residual_m=_scattered(found.residual_m, rows, len(m), np.nan),
        iterations=found.iterations,
        misfit=1.0 if kept.consistent else kept.trial.chi_square / kept.trial.freedom,
    )


def _scattered(values: F64, rows: Index, n: int, fill: float) -> F64:
    """(..., n) with values (..., k) in rows (k,) and `fill` elsewhere."""
    if len(rows) == n:
        return values
    out = np.full((*values.shape[:-1], n), fill)
    out[..., rows] = values
    return out
