"""The analogue of RU 2706636 C1: SIGI on the US segment of the ISS.

Each receiver solves alone, from its own antenna and on its own clock; the solutions are averaged with equal
weights. The position is the mean place of the antennas that have a solution: it differs from the centre of
mass by the mean lever arm, and steps when a receiver gains or loses its solution.

Receivers that have no solution are left out; if none has one, the reason is that of the one that came
nearest. Position and velocity are of the same point, so if one of the averaged solutions lacks a velocity,
the mean has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import GLONASS, NUMBERS
from gnss_hil.flightsw.estimation.fix_inputs import Circumstances, solve_alone
from gnss_hil.flightsw.estimation.position import GLONASS_OFFSET, Fix, NoFix, carried
from gnss_hil.flightsw.estimation.velocity import FASTEST_MPS
from gnss_hil.flightsw.measurement.noise import URA_M
from gnss_hil.flightsw.measurement.observables import Ranges


def averaged(m: Ranges, at: Circumstances) -> tuple[Fix | NoFix, int]:
    """The mean of the receivers' own solutions; no antenna leads."""
    found = [solve_alone(m, antenna, at) for antenna in range(len(at.domain))]
    fixes = [fix for fix in found if isinstance(fix, Fix)]
    # The reasons' numbers grow with how far a solution got.
    return mean_fix(m, fixes, at.ura_scale) if fixes else max(found), at.leading


def mean_fix(m: Ranges, fixes: Sequence[Fix], ura_scale: float) -> Fix | NoFix:
    """The mean of at least one fix of receivers alone.

    The dilution is that of the mean for errors of the same size, independent from measurement to measurement,
    and the solutions have no measurement in common: PDOP^2 = sum PDOP_a^2 / k^2.
    """
    share = 1 / len(fixes)
    glonass = m.sat >= GLONASS * NUMBERS
    alone = [bool(glonass[fix.used].all()) for fix in fixes]
    items, clock = mean_clocks([(fix.items, fix.clock_m) for fix in fixes], alone)
    position = share * sum(fix.position_m for fix in fixes)
    if not carried(position, clock):
        return NoFix.NO_CONVERGENCE
    velocity, drift = _mean_rates(fixes, alone)
    used = np.any([fix.used for fix in fixes], axis=0)
    gain = share * sum(fix.gain for fix in fixes)
    misfit = max(fix.misfit for fix in fixes)
    return Fix(
        position_m=position,
        velocity_mps=velocity,
        items=items,
        clock_m=clock,
        drift_mps=drift,
        covariance_m2=mean_covariance_m2(m, gain, ura_scale) * misfit,
        gain=gain,
        pdop=share * sqrt(sum(fix.pdop**2 for fix in fixes)),
        used=used,
        satellites=len(set(m.sat[used].tolist())),
        residual_m=_residuals_m(fixes, len(m)),
        iterations=max(fix.iterations for fix in fixes),
        misfit=misfit,
    )


def _residuals_m(fixes: Sequence[Fix], n: int) -> NDArray[np.float64]:
    """(n,) of each measurement from its own receiver's solution, nan where not used."""
    residual = np.full(n, np.nan)
    for fix in fixes:
        residual[fix.used] = fix.residual_m[fix.used]
    return residual


def mean_clocks(
    solutions: Sequence[tuple[tuple[int, ...], NDArray[np.float64]]], alone: Sequence[bool]
) -> tuple[tuple[int, ...], NDArray[np.float64]]:
    """Items (c,) and their means (c,), of biases or of drifts.

    solutions   items and values of each receiver: its domain and, if it hears both systems, the offset
    alone       whether a receiver uses GLONASS alone: then its clock contains the offset

    A domain's clock is the mean over its receivers that hear GPS; over all if none does, and then it contains
    the offset, as the contract says. The offset is the mean over the receivers that hear both systems, and
    over those that hear GLONASS alone in a domain where another hears GPS: by what their clocks are later.
    """
    by_gps: dict[int, list[float]] = {}
    by_glonass: dict[int, list[float]] = {}
    offsets: list[float] = []
    for (items, values), only_glonass in zip(solutions, alone, strict=True):
        domain, clock, *offset = items[0], *values.tolist()
        (by_glonass if only_glonass else by_gps).setdefault(domain, []).append(clock)
        offsets += offset
    clocks = {d: float(np.mean(by_gps.get(d) or by_glonass[d])) for d in sorted(by_gps | by_glonass)}
    for domain in by_gps.keys() & by_glonass.keys():
        offsets += [clock - clocks[domain] for clock in by_glonass[domain]]
    if offsets:
        clocks[GLONASS_OFFSET] = float(np.mean(offsets))
    return tuple(clocks), np.array(list(clocks.values()))


def _mean_rates(
    fixes: Sequence[Fix], alone: Sequence[bool]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | tuple[None, None]:
    """Velocity (3,) and drifts (c,); None if a solution lacks them or the bus cannot carry them."""
    if any(fix.velocity_mps is None for fix in fixes):
        return None, None
    velocity = sum(fix.velocity_mps for fix in fixes) / len(fixes)
    _, drift = mean_clocks([(fix.items, fix.drift_mps) for fix in fixes], alone)
    return (velocity, drift) if np.abs(drift).max() <= FASTEST_MPS else (None, None)


def mean_covariance_m2(m: Ranges, gain: NDArray[np.float64], ura_scale: float) -> NDArray[np.float64]:
    """Covariance (3, 3) of a position that moves by gain (3, n) for each metre of the pseudoranges.

    The code's noise is independent from measurement to measurement: with k solutions it is sum C_a / k^2. A
    satellite's own error (URA) is common to all receivers that measure it; it enters once, through the sum of
    their gains, and does not average out.
    """
    used = gain.any(axis=0)
    gain, sat, ura = gain[:, used], m.sat[used], m.ura[used].astype(np.intp)
    noise = (gain * m.code_variance_m2[used]) @ gain.T
    common = (gain * (ura_scale * URA_M[ura])) @ (sat[:, None] == np.unique(sat))
    return noise + common @ common.T
