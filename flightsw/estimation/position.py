"""Block 3 of RU 2706636 C1, steps 4 and 10: position from all tracked signals of all antennas.

Iterated weighted least squares of one epoch. Unknowns: the centre of mass, one clock for each clock domain
that measures, and the GLONASS system offset where some domain hears both systems (else a clock contains it).
Velocity and clock rates follow from the range rates of the same channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import GLONASS, NUMBERS
from gnss_hil.flightsw.estimation.least_squares import Solution, least_squares
from gnss_hil.flightsw.estimation.velocity import velocity_and_drift
from gnss_hil.flightsw.integrity.exclusion import STRICT, Reconciled, Rules, Trial, reconciled
from gnss_hil.flightsw.measurement import range_model
from gnss_hil.flightsw.measurement.noise import range_variance_m2
from gnss_hil.flightsw.measurement.observables import Ranges

GLONASS_OFFSET = 8
"""NAV_CLOCK item of the system offset; items 0..7 are clock domains."""

MAX_ITERATIONS = 12
CONVERGED_M = 10.0
"""A step this short ends the iteration: what Gauss-Newton leaves is step^2 / (2 range), 5 um at 1e7 m, and
the Earth's turn during the flight, a millionth of the step."""

MAX_PDOP = 655.35
"""The contract cannot state more; a geometry this poor is called singular."""

FARTHEST_M = LATEST_M = 109_900_000.0
"""What NAV_X..NAV_Z and NAV_CLOCK can carry."""


class NoFix(IntEnum):
    """As in the contract's value table."""

    FIX = 0
    TOO_FEW_SATELLITES = 1
    SINGULAR_GEOMETRY = 2
    NO_CONVERGENCE = 3
    NO_TIME_MARK = 4
    NO_ATTITUDE = 5
    INCONSISTENT_RANGES = 6
    NO_VELOCITY = 7


@dataclass(frozen=True, slots=True)
class Fix:
    """A solution for the point the lever arms are counted from, ECEF WGS-84, at the time mark.

    items        (c,) which clock each bias and drift is: domain 0..7 or GLONASS_OFFSET
    clock_m, drift_mps   (c,) clock minus GPS time and its rate, times c
    velocity_mps, drift_mps   None if the range rates contradict each other or the bus cannot carry them
    covariance_m2        (3, 3) of the position, grown by the misfit
    misfit       chi-square for each degree of freedom where ranges that disagree made the fix; else 1
    gain                 (3, n) what a metre of each pseudorange moves the position, zero where not used
    pdop         over the measurements used
    used         (n,) bool, which of the measurements offered are in the fix
    satellites   distinct ones among them
    residual_m   (n,) measured minus predicted pseudorange, nan where not used
    iterations   Gauss-Newton steps taken
    """

    position_m: NDArray[np.float64]
    velocity_mps: NDArray[np.float64] | None
    items: tuple[int, ...]
    clock_m: NDArray[np.float64]
    drift_mps: NDArray[np.float64] | None
    covariance_m2: NDArray[np.float64]
    gain: NDArray[np.float64]
    pdop: float
    used: NDArray[np.bool_]
    satellites: int
    residual_m: NDArray[np.float64]
    iterations: int
    misfit: float


@dataclass(frozen=True, slots=True)
class _Spheres:
    """Converged intersection: geometry at the solution, and what is left."""

    position_m: NDArray[np.float64]
    clock_m: NDArray[np.float64]
    solution: Solution
    design: NDArray[np.float64]
    rays: range_model.Rays
    residual_m: NDArray[np.float64]
    iterations: int


def carried(position_m: NDArray[np.float64], clock_m: NDArray[np.float64]) -> bool:
    """Whether the bus can carry a position (3,) and clocks (c,); an estimate beyond is no fix."""
    farthest, latest = (max(map(abs, v.tolist())) for v in (position_m, clock_m))
    return farthest <= FARTHEST_M and latest <= LATEST_M


def clock_columns(
    domain: NDArray[np.int64], glonass: NDArray[np.bool_]
) -> tuple[tuple[int, ...], NDArray[np.float64]]:
    """Items (c,) and design columns (n, c) of the clocks that these measurements can tell apart.

    The system offset is one of them only if a domain hears both systems: else each clock absorbs it, and the
    design would be singular.
    """
    heard = set(zip(domain.tolist(), glonass.tolist(), strict=True))
    domains = sorted({d for d, _ in heard})
    items = tuple(domains)
    columns = domain[:, None] == np.array(domains)
    if any((d, True) in heard and (d, False) in heard for d in domains):
        items += (GLONASS_OFFSET,)
        columns = np.column_stack((columns, glonass))
    return items, columns.astype(float)


def _intersect(
    m: Ranges,
    lever_m: NDArray[np.float64],
    clocks: NDArray[np.float64],
    variance_m2: NDArray[np.float64],
    start_m: NDArray[np.float64],
) -> _Spheres | NoFix:
    """Steps 4 and 10: the point on all spheres; lever_m (3, n) from the centre of mass to each antenna."""
    measured = m.pseudorange_m + m.clock_m
    weight = 1 / variance_m2
    position = start_m
    design = np.empty((len(m), 3 + clocks.shape[1]))
    design[:, 3:] = clocks
    for iteration in range(1, MAX_ITERATIONS + 1):
        rays = range_model.rays(m.pos_sv_m, lever_m + position[:, None])
        design[:, :3] = -rays.los.T
        misfit = measured - rays.range_m
        solution = least_squares(design, misfit, weight)
        if solution is None:
            return NoFix.SINGULAR_GEOMETRY
        step = solution.x[:3]
        position = position + step
        length = sqrt(step @ step)
        if length < CONVERGED_M:
            residual = misfit - design @ solution.x
            # The direction from 10 m aside costs 4 mm/s of velocity: rays from where the craft is.
            rays = range_model.rays(m.pos_sv_m, lever_m + position[:, None])
            design[:, :3] = -rays.los.T
            return _Spheres(position, solution.x[3:], solution, design, rays, residual, iteration)
        if not length < 1e9:
            break
    return NoFix.NO_CONVERGENCE


def _solved(
    m: Ranges,
    lever_m: NDArray[np.float64],
    domain: NDArray[np.int64],
    start_m: NDArray[np.float64],
    ura_scale: float,
) -> Trial | NoFix:
    """Intersection of all that is offered, with its clock items."""
    items, clocks = clock_columns(domain, m.sat >= GLONASS * NUMBERS)
    needed = 4 + (GLONASS_OFFSET in items)
    if len(set(m.sat.tolist())) < needed or len(m) < 3 + len(items):
        return NoFix.TOO_FEW_SATELLITES
    variance = range_variance_m2(m.code_variance_m2, m.ura, m.sat, ura_scale)
    spheres = _intersect(m, lever_m, clocks, variance, start_m)
    if isinstance(spheres, NoFix):
        return spheres
    return Trial((spheres, items), spheres.design, spheres.residual_m, variance)


def _consistent(
    m: Ranges,
    lever_m: NDArray[np.float64],
    domain: NDArray[np.int64],
    start_m: NDArray[np.float64],
    ura_scale: float,
    rules: Rules,
) -> Reconciled | NoFix:
    """Intersection of what agrees, or as the rules say."""
    first: list[Trial | NoFix] = []

    def fit(rows: NDArray[np.intp]) -> Trial | None:
        every = len(rows) == len(m)
        trial = (
            _solved(m, lever_m, domain, start_m, ura_scale)
            if every
            else _solved(m[rows], lever_m[:, rows], domain[rows], start_m, ura_scale)
        )
        first.append(trial)
        return None if isinstance(trial, NoFix) else trial

    found = reconciled(fit, m.sat, rules)
    if found is not None:
        return found
    return first[0] if isinstance(first[0], NoFix) else NoFix.INCONSISTENT_RANGES


def solve(
    m: Ranges,
    lever_m: NDArray[np.float64],
    lever_rate_mps: NDArray[np.float64],
    domain: NDArray[np.int64],
    start_m: NDArray[np.float64] | None = None,
    ura_scale: float = 1.0,
    rules: Rules = STRICT,
) -> Fix | NoFix:
    """The fix of an epoch, or why there is none.

    m                         ranges offered, n rows
    lever_m, lever_rate_mps   (3, n) antenna relative to the centre of mass, Greenwich frame, and its rate
    domain                    (n,) clock domain
    start_m                   (3,) where to start; without it, or if it leads nowhere, the Earth's centre
    ura_scale                 how much of the broadcast URA counts in the weights
    rules                     what becomes of measurements that disagree
    """
    starts = [np.zeros(3)] if start_m is None else [start_m, np.zeros(3)]
    for start in starts:
        found = _consistent(m, lever_m, domain, start, ura_scale, rules)
        if not isinstance(found, NoFix) or found == NoFix.TOO_FEW_SATELLITES:
            break
    if isinstance(found, NoFix):
        return found
    rows, (spheres, items) = found.rows, found.trial.found
    pdop = sqrt(sum(spheres.solution.cofactor.diagonal()[:3].tolist()))
    if pdop > MAX_PDOP:
        return NoFix.SINGULAR_GEOMETRY
    if not carried(spheres.position_m, spheres.clock_m):
        return NoFix.NO_CONVERGENCE
    every = len(rows) == len(m)
    velocity, drift = velocity_and_drift(
        m if every else m[rows],
        spheres.design,
        spheres.rays,
        lever_rate_mps if every else lever_rate_mps[:, rows],
        rules,
    )
    misfit = 1.0 if found.agree else found.trial.misfit / found.trial.freedom
    used = np.zeros(len(m), bool)
    used[rows] = True
    residual = np.full(len(m), np.nan)
    residual[rows] = spheres.residual_m
    gain = np.zeros((3, len(m)))
    gain[:, rows] = spheres.solution.gain[:3]
    return Fix(
        position_m=spheres.position_m,
        velocity_mps=velocity,
        items=items,
        clock_m=spheres.clock_m,
        drift_mps=drift,
        covariance_m2=spheres.solution.covariance[:3, :3] * misfit,
        gain=gain,
        pdop=pdop,
        used=used,
        satellites=len(set(m.sat[rows].tolist())),
        residual_m=residual,
        iterations=spheres.iterations,
        misfit=misfit,
    )
