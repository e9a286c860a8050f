"""Block 3 of RU 2706636 C1, steps 4 and 10: position from all tracked signals of all antennas.

Iterated weighted least squares of one epoch. Unknowns: the centre of mass, one clock for each clock domain
that measures, and the time offset of each system that can be told apart from them (`estimation.clocks`).
Velocity and clock rates follow from the range rates of the same channels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Index
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.flightsw.estimation import receiver_delays
from gnss_hil.flightsw.estimation.clocks import clock_columns, is_offset
from gnss_hil.flightsw.estimation.least_squares import Estimate, least_squares, scattered
from gnss_hil.flightsw.estimation.prior import Prior
from gnss_hil.flightsw.estimation.velocity import motion, rough_velocity
from gnss_hil.flightsw.integrity import exclusion, reliability
from gnss_hil.flightsw.integrity.consistency import Trial
from gnss_hil.flightsw.integrity.exclusion import STRICT, Kept, Refusal, Rules, Units
from gnss_hil.flightsw.integrity.range_gate import plausible
from gnss_hil.flightsw.measurement.budget import Budget, range_errors
from gnss_hil.flightsw.measurement.code_range import CodeRanges, code_ranges
from gnss_hil.flightsw.measurement.ionosphere import Ionosphere, delay_rate
from gnss_hil.flightsw.measurement.range_model import Rays, rays
from gnss_hil.flightsw.measurement.range_rate import RangeRates, range_rates
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import MAX_PDOP, NoFix, ReceiverDelays, SnapshotFix, Tested, carriable

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
    weight: F64
    iterations: int


@dataclass(frozen=True, slots=True)
class Held:
    """An attitude that was turned on: 1 sigma about each axis of it, and of its rate."""

    sigma_rad: float
    rate_sigma_rps: float


@dataclass(frozen=True, slots=True, eq=False)
class Offered:
    """Measurements offered to a fix with what belongs to each: lever_m, lever_rate_mps (3, n) of its antenna,
    domain (n,) of its clock; budget, ionosphere: see `estimation.base.FixInputs`; delays of
    the receivers as far as they are known; prior: what the fixes before say, where they do; held: how
    far the attitude is known, where it is not this epoch's."""

    ranges: Ranges
    lever_m: F64
    lever_rate_mps: F64
    domain: I64
    budget: Budget
    ionosphere: Ionosphere | None
    delays: ReceiverDelays | None
    prior: Prior | None
    held: Held | None

    def __len__(self) -> int:
        return len(self.ranges)

    def __getitem__(self, rows: Index) -> Offered:
        if len(rows) == len(self):
            return self
        lever_m, lever_rate_mps = self.lever_m[:, rows], self.lever_rate_mps[:, rows]
        return replace(
            self,
            ranges=self.ranges[rows],
            lever_m=lever_m,
            lever_rate_mps=lever_rate_mps,
            domain=self.domain[rows],
        )


def intersect(z: CodeRanges, items: tuple[int, ...], start_m: F64) -> Intersection | NoFix:
    """Steps 4 and 10: the point on all spheres, searched from start_m (3,)."""
    position = start_m
    for iteration in range(1, MAX_ITERATIONS + 1):
        rays = z.rays(position)
        design = z.design(rays)
        delay_m, weight = z.errors.at(rays)
        misfit = z.value - rays.range_m - delay_m
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
                position, estimate.x[3:], items, estimate, z.design(rays), rays, residual, weight, iteration
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
    errors = range_errors(m, offered.budget, offered.ionosphere, offered.delays)
    if offered.held is not None:
        errors = replace(errors, lever_m=offered.lever_m, turned_rad=offered.held.sigma_rad)
    found = intersect(code_ranges(m, offered.lever_m, clocks, errors), items, start_m)
    if isinstance(found, NoFix):
        return found
    trial, prior = _of_ranges(found), offered.prior
    return trial if prior is None else trial.beside(prior.position_m - found.position_m, prior.covariance_m2)


def _of_ranges(found: Intersection) -> Trial[Intersection]:
    return Trial(found, found.design, found.residual_m, found.weight, found.estimate.covariance)


_REASON = {
    Refusal.INCONSISTENT: NoFix.INCONSISTENT_RANGES,
    Refusal.AGAINST_BEFORE: NoFix.AGAINST_ORBIT,
}


def _consistent(offered: Offered, start_m: F64, rules: Rules) -> Kept[Intersection] | NoFix:
    """Intersection of what agrees, or as the rules have it."""
    first = _trial(offered, start_m)
    if isinstance(first, NoFix):
        return first

    def refit(rows: Index) -> Trial[Intersection] | None:
        trial = _trial(offered[rows], start_m)
        return None if isinstance(trial, NoFix) else trial

    units = Units(offered.ranges.sat, offered.ranges.receiver)
    kept = exclusion.exclude(first, refit, units, rules)
    return _REASON[kept] if isinstance(kept, Refusal) else kept


def _from_starts(offered: Offered, start_m: F64 | None, rules: Rules) -> Kept[Intersection] | NoFix:
    """From start_m if there is one; without it, or if it leads nowhere, from the Earth's centre. If that
    leads nowhere either, without what no orbit explains."""
    if start_m is not None:
        kept = _consistent(offered, start_m, rules)
        if not isinstance(kept, NoFix) or kept is NoFix.TOO_FEW_SATELLITES:
            return kept
    kept = _consistent(offered, np.zeros(3), rules)
    if kept not in (NoFix.NO_CONVERGENCE, NoFix.SINGULAR_GEOMETRY):
        return kept
    found = [
        lesser
        for rows in _lesser(offered, start_m, rules)
        if not isinstance(lesser := _of_rows(offered, rows, start_m, rules), NoFix)
    ]
    widest = max(found, key=lambda one: len(one.rows), default=None)
    if widest is None or not all(np.isin(one.rows, widest.rows).all() for one in found):
        return kept  # several ways out, and none that has what the others have
    return widest


def _lesser(offered: Offered, start_m: F64 | None, rules: Rules) -> Iterator[Index]:
    """Rows that may have a fix where all have none: those that an orbit explains, if these are not all; else
    all but one satellite, whichever it is."""
    z = offered.ranges
    expected_m = None if start_m is None else rays(z.pos_sv_m, offered.lever_m + start_m[:, None]).range_m
    near = plausible(z.pseudorange_m + z.clock_m, expected_m, offered.domain)
    if not near.all():
        yield np.flatnonzero(near)
    elif rules.exclude:
        for sat in np.unique(z.sat):
            yield np.flatnonzero(z.sat != sat)


def _of_rows(offered: Offered, rows: Index, start_m: F64 | None, rules: Rules) -> Kept[Intersection] | NoFix:
    """The fix of some rows, if others check it."""
    kept = _consistent(offered[rows], np.zeros(3) if start_m is None else start_m, rules)
    if isinstance(kept, NoFix):
        return kept
    return NoFix.NO_CONVERGENCE if kept.trial.freedom < 1 else replace(kept, rows=rows[kept.rows])


def solve(
    m: Ranges,
    lever_m: F64,
    lever_rate_mps: F64,
    domain: I64,
    start_m: F64 | None,
    budget: Budget,
    ionosphere: Ionosphere | None = None,
    rules: Rules = STRICT,
    delays: ReceiverDelays | None = None,
    unlearnt_s: float = 0.0,
    prior: Prior | None = None,
    held: Held | None = None,
) -> SnapshotFix | NoFix:
    """The fix of an epoch, or why there is none.

    m                         ranges offered, n rows
    lever_m, lever_rate_mps   (3, n) antenna relative to the centre of mass, Greenwich frame, and its rate
    domain                    (n,) clock domain
    start_m                   (3,) where to start; without it, or if it leads nowhere, the Earth's centre
    budget, ionosphere        what ranges err by, see `estimation.base.FixInputs`
    rules                     what becomes of measurements that disagree
    delays                    of the receivers, as far as they are known; None: not learnt
    unlearnt_s                since they were learnt
    prior                     what the fixes before say; it judges the ranges, and is no part of the fix
    held                      how far the attitude is known, where it is an earlier one turned on
    """
    prior = prior if rules.refuse else None
    offered = Offered(m, lever_m, lever_rate_mps, domain, budget, ionosphere, delays, prior, held)
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
    sat = used.ranges.sat
    moving = motion(_rates(used, found), Units(sat, used.ranges.receiver), rules, prior)
    covariance, gain = found.estimate.covariance, found.estimate.gain[:3]
    among_offered = np.zeros(len(m), bool)
    among_offered[rows] = True
    return SnapshotFix(
        position_m=found.position_m,
        velocity_mps=None if moving is None else moving.velocity_mps,
        items=found.items,
        clock_m=found.clock_m,
        drift_mps=None if moving is None else moving.drift_mps,
        covariance_m2=covariance[:3, :3],
        clock_variance_m2=covariance.diagonal()[3:],
        velocity_covariance_m2ps2=None if moving is None else moving.covariance[:3, :3],
        velocity_gain=None if moving is None else scattered(moving.gain, rows, len(m), 0.0),
        rate_misfit=1.0 if moving is None else moving.misfit,
        drift_variance_m2ps2=None if moving is None else moving.covariance.diagonal()[3:],
        gain=scattered(gain, rows, len(m), 0.0),
        pdop=pdop,
        used=among_offered,
        satellites=used.ranges.satellites,
        residual_m=scattered(found.residual_m, rows, len(m), np.nan),
        iterations=found.iterations,
        delays=_learnt(delays, used, found, unlearnt_s) if delays is not None and kept.consistent else None,
        misfit=kept.misfit,
        tested=_tested(kept, gain, covariance[:3, :3], sat, prior is None or prior.checked),
    )


def _tested(kept: Kept[Intersection], gain: F64, covariance: F64, sat: I64, by_prior: bool) -> Tested:
    """by_prior: whether what was known before bears witness."""
    if not kept.consistent:
        return Tested.UNTESTED
    trial = kept.trial if by_prior else _of_ranges(kept.trial.found)
    return reliability.tested(trial, gain, covariance, sat)


def _learnt(delays: ReceiverDelays, used: Offered, found: Intersection, dt_s: float) -> ReceiverDelays | None:
    """What a fix tells of the receivers' delays; None while it is too soon after the last one."""
    if dt_s < receiver_delays.EVERY_S:
        return None
    weight = found.weight if found.weight.ndim == 2 else np.diag(found.weight)
    told = receiver_delays.learnt(
        delays, used.ranges.receiver, found.design, found.residual_m, weight, found.estimate.covariance, dt_s
    )
    return receiver_delays.walked(told, dt_s)


def _rates(used: Offered, found: Intersection) -> RangeRates:
    """Range rates of the ranges of a fix, without the ionosphere where these are."""
    z = used.ranges
    rates = range_rates(z, found.design, found.rays, used.lever_rate_mps)
    if used.held is not None:
        turning = used.held.rate_sigma_rps * np.cross(used.lever_m.T, found.rays.los.T)
        rates = replace(rates, common=turning)
    if used.ionosphere is None or not z.electrons.any():
        return rates
    antenna_mps = used.lever_rate_mps + rough_velocity(rates)[:, None]
    return rates.without(delay_rate(used.ionosphere, found.rays, antenna_mps, z.vel_sv_mps), z.electrons)
