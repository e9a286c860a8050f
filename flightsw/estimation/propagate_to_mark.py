"""From the instant of the latch to the time mark, where the two are not the same.

A mark may be what a receiver's own clock showed. All receivers then latched at GPS time mark - b, where b is
that clock's offset, and the fix is of that instant: in a low orbit 7.6 m away for each millisecond. It is
brought to GPS time = mark, along the orbit, by the very offset it has found.

What else depends on time does not notice: satellites' coordinates are those of their transmission instants,
and lever arms, which the attitude at the latch turns, would turn by 1e-6 rad in a millisecond.

A mark may also be in doubt. Where the craft is at the time that it shows is then as uncertain, along its way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS
from gnss_hil.flightsw.orbit.propagator import acceleration, propagate
from gnss_hil.flightsw.records.solution import (
    FASTEST_MPS,
    Fix,
    NoFix,
    OrbitState,
    carriable,
    within,
    without_motion,
)


def propagated_to_mark(fix: Fix, clock: int, last_mps: F64 | None) -> Fix | NoFix:
    """A fix of the latch as one of the mark. Clocks stay those of the latch: their drift, 1e-6 at most, makes
    a nanosecond of a millisecond.

    clock       of the mark, see `gnss_hil.flightsw.records.epoch.Mark`
    last_mps   (3,) velocity to go by where the fix has none, None if there is none either
    returns     NO_VELOCITY where there is no velocity, TOO_FEW_SATELLITES where the clock that showed the
                mark is not part of the fix, NO_CONVERGENCE where it ends beyond what the bus can carry
    """
    if clock == 0:
        return fix
    if clock - 1 not in fix.items:
        return NoFix.TOO_FEW_SATELLITES
    velocity = last_mps if fix.velocity_mps is None else fix.velocity_mps
    if velocity is None:
        return NoFix.NO_VELOCITY
    # What the bus can carry bounds the offset: 0.37 s.
    offset_s = float(fix.clock_m[fix.items.index(clock - 1)]) / LIGHT_MPS
    position, velocity = propagate(fix.position_m, velocity, offset_s)
    if not carriable(position, fix.clock_m):
        return NoFix.NO_CONVERGENCE
    if fix.velocity_mps is None or not within(velocity.tolist(), FASTEST_MPS):
        return replace(without_motion(fix), position_m=position)
    return replace(fix, position_m=position, velocity_mps=velocity)


def in_doubt(fix: Fix, doubt_s: float, last_mps: F64 | None) -> Fix | NoFix:
    """A fix whose mark may be off by so much (1 sigma); NO_VELOCITY where none tells how far that is."""
    velocity = last_mps if fix.velocity_mps is None else fix.velocity_mps
    if velocity is None:
        return NoFix.NO_VELOCITY
    moved_m, faster_mps = _within(doubt_s, fix.position_m, velocity)
    of_velocity = fix.velocity_covariance_m2ps2
    return replace(
        fix,
        covariance_m2=fix.covariance_m2 + np.outer(moved_m, moved_m) / fix.misfit,
        velocity_covariance_m2ps2=None
        if of_velocity is None
        else of_velocity + np.outer(faster_mps, faster_mps),
    )


def orbit_in_doubt(orbit: OrbitState, doubt_s: float) -> OrbitState:
    """An orbit at a mark that may be off by so much."""
    covariance, of_velocity = orbit.covariance_m2, orbit.velocity_covariance_m2ps2
    if orbit.velocity_mps is None or covariance is None or of_velocity is None:
        return orbit
    moved_m, faster_mps = _within(doubt_s, orbit.position_m, orbit.velocity_mps)
    return replace(
        orbit,
        covariance_m2=covariance + np.outer(moved_m, moved_m),
        velocity_covariance_m2ps2=of_velocity + np.outer(faster_mps, faster_mps),
    )


def _within(time_s: float, position_m: F64, velocity_mps: F64) -> tuple[F64, F64]:
    """(3,) how far the craft comes in a short time, and how much faster."""
    gravity = np.array(acceleration(*position_m.tolist(), *velocity_mps[:2].tolist()))
    return time_s * velocity_mps, time_s * gravity
