"""Positions carried on by velocities, beside the fixes: is the way they make the one they say they make?

A fault that grows slowly takes the fixes with it, each a little beside the orbit of the one before, which has
gone along. The velocities come of other measurements, range rates, and know nothing of it: added up since a
fix of minutes ago, they say where the craft is. So they do of engines, which an orbit does not know of.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.estimation.prior import ACCELERATION_MPS2, apart
from gnss_hil.flightsw.orbit.propagator import acceleration
from gnss_hil.flightsw.records.solution import Fix, OrbitState, Tested

BEGUN_S = 150.0
"""Another position is carried from here on when the last one is so old; two are, so the older one is up to
twice as old: what contradicts it for longer is believed, as it is of an orbit."""

GAP_S = 30.0
"""So long may be between two velocities: the orbit bends otherwise than they tell."""


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """A position on its way, ECEF.

    begun_ns, t_ns         GPS time of the fix that it began with, and of the last velocity
    position_m, velocity_mps (3,)   at t_ns
    covariance_m2 (3, 3)   of the fix that it began with
    spread_m2ps (3, 3)     what velocities' covariances have added up to, over time
    bent_m2                variance of what engines did between two velocities
    tested                 how well the fix that it began with was: as well as it can be
    """

    begun_ns: int
    t_ns: int
    position_m: F64
    velocity_mps: F64
    covariance_m2: F64
    spread_m2ps: F64
    bent_m2: float = 0.0
    tested: bool = False

    @property
    def age_s(self) -> float:
        return (self.t_ns - self.begun_ns) * 1e-9

    @property
    def now_m2(self) -> F64:
        """(3, 3) covariance at t_ns: a velocity's error may last, as those of satellites' clocks do."""
        return self.covariance_m2 + self.age_s * self.spread_m2ps + self.bent_m2 * np.eye(3)

    @property
    def orbit(self) -> OrbitState:
        """As the orbit that an epoch is judged by."""
        return OrbitState(
            self.t_ns,
            self.position_m,
            self.velocity_mps,
            self.t_ns,
            self.now_m2,
            self.spread_m2ps / self.age_s,
            checked=True,
        )


Ways = tuple[Carried, ...]
"""Those on their way, the oldest first."""


def carried_on(ways: Ways, t_ns: int, fix: Fix) -> Ways:
    """Those whose last velocity is not too old at the time of a fix, there by its velocity if it has one."""
    ways = tuple(way for way in ways if 0 <= t_ns - way.t_ns <= GAP_S * 1e9)
    velocity, covariance = fix.velocity_mps, fix.velocity_covariance_m2ps2
    if velocity is None or covariance is None:
        return ways
    return tuple(_moved(way, t_ns, velocity, covariance) for way in ways)


def _moved(way: Carried, t_ns: int, velocity_mps: F64, covariance_m2ps2: F64) -> Carried:
    """Trapezoids of velocities, corrected by what gravity bends between: fourth order."""
    dt_s = (t_ns - way.t_ns) * 1e-9
    middle = way.position_m + 0.5 * dt_s * (way.velocity_mps + velocity_mps)
    bend = _gravity(way.position_m, way.velocity_mps) - _gravity(middle, velocity_mps)
    return replace(
        way,
        t_ns=t_ns,
        position_m=middle + dt_s**2 / 12 * bend,
        velocity_mps=velocity_mps,
        spread_m2ps=way.spread_m2ps + dt_s * covariance_m2ps2,
        bent_m2=way.bent_m2 + (ACCELERATION_MPS2 * dt_s**2 / 12) ** 2,
    )


def _gravity(position_m: F64, velocity_mps: F64) -> F64:
    return np.array(acceleration(*position_m.tolist(), *velocity_mps[:2].tolist()))


def begun(ways: Ways, t_ns: int, fix: Fix) -> Ways:
    """With one that begins at a fix, if it is time."""
    velocity, of_velocity = fix.velocity_mps, fix.velocity_covariance_m2ps2
    if velocity is None or of_velocity is None or fix.tested is Tested.UNTESTED:
        return ways
    if ways and ways[-1].age_s < BEGUN_S:
        return ways
    sure = fix.tested is Tested.TESTED
    own, nothing = fix.covariance_m2, np.zeros((3, 3))
    return (*ways[-1:], Carried(t_ns, t_ns, fix.position_m, velocity, own, nothing, tested=sure))


def gone_astray(ways: Ways, t_ns: int, fix: Fix) -> Ways:
    """Those that a fix contradicts: it is not where velocities have led. A fix that is tested need not follow
    from one that was not."""
    sure = fix.tested is Tested.TESTED
    return tuple(
        way
        for way in ways
        if way.begun_ns < way.t_ns == t_ns
        and (way.tested or not sure)
        and apart(fix.position_m - way.position_m, fix.covariance_m2 + way.now_m2)
    )
