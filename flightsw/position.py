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

from dbc.satellites import GLONASS, NUMBERS
from flightsw import ranging
from flightsw.adjust import Solution, adjusted, least_squares
from flightsw.consistency import agree, culprit
from flightsw.earth import LIGHT_MPS
from flightsw.epoch import Measurements
from flightsw.sigma import range_variance_m2, rate_variance_m2ps2

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

FASTEST_MPS = 13_421.0
"""What NAV_VX..NAV_VZ and NAV_DRIFT can carry; a rate beyond is no velocity."""


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
    covariance_m2        (3, 3) of the position
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


@dataclass(frozen=True, slots=True)
class _Spheres:
    """Converged intersection: geometry at the solution, and what is left."""

    position_m: NDArray[np.float64]
    clock_m: NDArray[np.float64]
    solution: Solution
    design: NDArray[np.float64]
    rays: ranging.Rays
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
    m: Measurements,
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
        rays = ranging.rays(m.pos_sv_m, lever_m + position[:, None])
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
            rays = ranging.rays(m.pos_sv_m, lever_m + position[:, None])
            design[:, :3] = -rays.los.T
            return _Spheres(position, solution.x[3:], solution, design, rays, residual, iteration)
        if not length < 1e9:
            break
    return NoFix.NO_CONVERGENCE


def _adjusted(
    m: Measurements,
    lever_m: NDArray[np.float64],
    domain: NDArray[np.int64],
    start_m: NDArray[np.float64],
    ura_scale: float,
) -> tuple[_Spheres, tuple[int, ...], NDArray[np.float64], bool] | NoFix:
    """Intersection of all that is offered, clock items, variances (n,), and whether the ranges agree."""
    items, clocks = clock_columns(domain, m.sat >= GLONASS * NUMBERS)
    needed = 4 + (GLONASS_OFFSET in items)
    if len(set(m.sat.tolist())) < needed or len(m) < 3 + len(items):
        return NoFix.TOO_FEW_SATELLITES
    variance = range_variance_m2(m.cn0_dbhz, m.ura, m.sat, ura_scale)
    spheres = _intersect(m, lever_m, clocks, variance, start_m)
    if isinstance(spheres, NoFix):
        return spheres
    return spheres, items, variance, agree(spheres.residual_m, variance, 3 + len(items))


def _consistent(
    m: Measurements,
    lever_m: NDArray[np.float64],
    domain: NDArray[np.int64],
    start_m: NDArray[np.float64],
    ura_scale: float,
) -> tuple[_Spheres, tuple[int, ...], NDArray[np.intp]] | NoFix:
    """Intersection, after the exclusion of at most one satellite; clock items; rows used."""
    rows = np.arange(len(m))
    found = _adjusted(m, lever_m, domain, start_m, ura_scale)
    if isinstance(found, NoFix):
        return found
    spheres, items, variance, good = found
    if not good:
        suspect = culprit(m.sat, spheres.design, spheres.residual_m, variance)
        if suspect is None:
            return NoFix.INCONSISTENT_RANGES
        rows = rows[m.sat != suspect]
        found = _adjusted(m[rows], lever_m[:, rows], domain[rows], start_m, ura_scale)
        if isinstance(found, NoFix) or not found[-1]:
            return NoFix.INCONSISTENT_RANGES
        spheres, items, *_ = found
    return spheres, items, rows


def _rates(
    m: Measurements, s: _Spheres, lever_rate_mps: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Velocity (3,) of the centre of mass and clock rates (c,) from range rates, after the exclusion of at
    most one satellite; None if the range rates contradict each other.

    dP/dt = clock rate + rho' - satellite clock rate (1 - rho' / c), all by GPS time.
    """
    static, gain = ranging.rate_terms(s.rays, m.vel_sv_mps)
    stretch = 1 + m.clock_drift_mps / LIGHT_MPS
    gain = gain * stretch
    lever = np.einsum("in,in->n", s.rays.los, lever_rate_mps)
    design = s.design.copy()
    design[:, :3] *= gain[:, None]
    y = m.range_rate_mps + m.clock_drift_mps - stretch * static + gain * lever
    variance = rate_variance_m2ps2(m.cn0_dbhz)
    x = adjusted(design, y, 1 / variance)
    residual = y - design @ x
    if not agree(residual, variance, len(x)):
        suspect = culprit(m.sat, design, residual, variance)
        if suspect is None:
            return None
        rows = m.sat != suspect
        # A clock heard on the excluded satellite only has no rate any more: not observable.
        solution = least_squares(design[rows], y[rows], 1 / variance[rows])
        if solution is None or not agree((y - design @ solution.x)[rows], variance[rows], len(x)):
            return None
        x = solution.x
    return (x[:3], x[3:]) if max(map(abs, x.tolist())) <= FASTEST_MPS else None


def solve(
    m: Measurements,
    lever_m: NDArray[np.float64],
    lever_rate_mps: NDArray[np.float64],
    domain: NDArray[np.int64],
    start_m: NDArray[np.float64] | None = None,
    ura_scale: float = 1.0,
) -> Fix | NoFix:
    """The fix of an epoch, or why there is none.

    m                         measurements offered, n rows
    lever_m, lever_rate_mps   (3, n) antenna relative to the centre of mass, Greenwich frame, and its rate
    domain                    (n,) clock domain
    start_m                   (3,) where to start; without it, or if it leads nowhere, the Earth's centre
    ura_scale                 how much of the broadcast URA counts in the weights
    """
    starts = [np.zeros(3)] if start_m is None else [start_m, np.zeros(3)]
    for start in starts:
        found = _consistent(m, lever_m, domain, start, ura_scale)
        if not isinstance(found, NoFix) or found == NoFix.TOO_FEW_SATELLITES:
            break
    if isinstance(found, NoFix):
        return found
    spheres, items, rows = found
    pdop = sqrt(sum(spheres.solution.cofactor.diagonal()[:3].tolist()))
    if pdop > MAX_PDOP:
        return NoFix.SINGULAR_GEOMETRY
    if not carried(spheres.position_m, spheres.clock_m):
        return NoFix.NO_CONVERGENCE
    every = len(rows) == len(m)
    velocity, drift = _rates(
        m if every else m[rows], spheres, lever_rate_mps if every else lever_rate_mps[:, rows]
    ) or (None, None)
    used = np.zeros(len(m), bool)
    used[rows] = True
    residual = np.full(len(m), np.nan)
    residual[rows] = spheres.residual_m
    gain = np.zeros((3, len(m)))
    gain[:, rows] = spheres.solution.gain[:3]
    return Fix(
        spheres.position_m,
        velocity,
        items,
        spheres.clock_m,
        drift,
        spheres.solution.covariance[:3, :3],
        gain,
        pdop,
        used,
        len(set(m.sat[rows].tolist())),
        residual,
        spheres.iterations,
    )
