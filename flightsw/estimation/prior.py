"""What the fixes before say of an epoch: where the craft must be, and how fast, if it flew on.

A range whose fault moves the fix without contradicting another range does contradict the second before. The
fixes before judge an epoch's measurements (`integrity.exclusion`); its fix is made of these alone, so that
its errors are those of its own ranges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.integrity.consistency import chi2_limit
from gnss_hil.flightsw.records.solution import Fix, OrbitState, Tested

ACCELERATION_MPS2 = 0.5
"""1 sigma of what engines do that nobody tells the flight software of: Soyuz by its main engine."""

LEAST_TRUSTED_S, MOST_TRUSTED_S = 10.0, 300.0
"""So long after its fix an orbit is asked: the longer, the longer fixes have agreed with it. What contradicts
it for longer is believed: else a first fix that was wrong would never be got rid of."""


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """At the time mark, ECEF: position_m (3,) and velocity_mps (3,), with a covariance (3, 3) each.

    checked   whether it bears witness for a fix: one that nothing could contradict may err as the fix does
    """

    position_m: F64
    covariance_m2: F64
    velocity_mps: F64
    velocity_covariance_m2ps2: F64
    checked: bool


def prior_of(orbit: OrbitState | None) -> Prior | None:
    """Of an orbit propagated to the epoch; None where it does not say how far it is known, or is too old.

    What the errors of two epochs have in common, a satellite's clock, is not taken out: the test is the
    milder for it.
    """
    if orbit is None or orbit.velocity_mps is None:
        return None
    covariance, of_velocity = orbit.covariance_m2, orbit.velocity_covariance_m2ps2
    if covariance is None or of_velocity is None:
        return None
    dt_s = (orbit.t_ns - orbit.fix_ns) * 1e-9
    if dt_s > orbit.trusted_s:
        return None
    gained_m2ps2 = (ACCELERATION_MPS2 * dt_s) ** 2 * np.eye(3)
    moved = covariance + dt_s**2 * (of_velocity + 0.25 * gained_m2ps2)
    return Prior(orbit.position_m, moved, orbit.velocity_mps, of_velocity + gained_m2ps2, orbit.checked)


def contradicted(fix: Fix, prior: Prior) -> bool:
    """Whether a fix at the time mark is not where the fixes before say, or not as fast.

    For every navigator: those that solve antennas one by one have no other test against what was before, and
    a fix that was carried to its mark by its own clock has not met it yet.
    """
    if apart(fix.position_m - prior.position_m, fix.covariance_m2 * fix.misfit + prior.covariance_m2):
        return True
    of_velocity = fix.velocity_covariance_m2ps2
    if fix.velocity_mps is None or of_velocity is None:
        return False
    return apart(fix.velocity_mps - prior.velocity_mps, of_velocity + prior.velocity_covariance_m2ps2)


def apart(difference: F64, covariance: F64) -> bool:
    """Whether a difference (3,) is none of its covariance (3, 3)."""
    return not difference @ np.linalg.solve(covariance, difference) <= chi2_limit(3)


def trusted_s(fix: Fix, before: OrbitState | None) -> float:
    """How long the orbit of a fix is asked, after the orbit before, propagated to it: for longest where other
    ranges checked the fix; else as long as fixes have agreed."""
    if fix.tested is Tested.TESTED:
        return MOST_TRUSTED_S
    if before is None or prior_of(before) is None:
        return LEAST_TRUSTED_S
    return min(before.trusted_s + (before.t_ns - before.fix_ns) * 1e-9, MOST_TRUSTED_S)
