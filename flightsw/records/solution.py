"""What a navigator makes of an epoch: an estimate with its covariance, or the reason why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from math import hypot

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.dbc.contract.values import raw_of

FARTHEST_M = 109_900_000.0
"""What NAV_X..NAV_Z and NAV_CLOCK can carry."""

FASTEST_MPS = 13_421.0
"""What NAV_VX..NAV_VZ and NAV_DRIFT can carry; a rate beyond is no velocity."""

MAX_PDOP = 655.35
"""The contract cannot state more; a geometry this poor is called singular."""


_NO_FIX, _NAV_MODE, _TESTED = raw_of("NoFix"), raw_of("NavMode"), raw_of("Tested")


class NoFix(IntEnum):
    """Why there is no fix, as in the contract's value table."""

    FIX = _NO_FIX["FIX"]
    TOO_FEW_SATELLITES = _NO_FIX["TOO_FEW_SATELLITES"]
    SINGULAR_GEOMETRY = _NO_FIX["SINGULAR_GEOMETRY"]
    NO_CONVERGENCE = _NO_FIX["NO_CONVERGENCE"]
    NO_TIME_MARK = _NO_FIX["NO_TIME_MARK"]
    NO_ATTITUDE = _NO_FIX["NO_ATTITUDE"]
    INCONSISTENT_RANGES = _NO_FIX["INCONSISTENT_RANGES"]
    NO_VELOCITY = _NO_FIX["NO_VELOCITY"]
    AGAINST_ORBIT = _NO_FIX["AGAINST_ORBIT"]


_FIX = NoFix.FIX


class SolutionError(ValueError):
    """A navigator's author has made it wrong; no measurement does that."""


class Tested(IntEnum):
    """What contradicts a fix that is wrong, as in the contract's value table.

    UNTESTED   nothing, for some measurement of it
    CHECKED    others, or the fixes before; a fault may be too small for them and too large for the sigma
    TESTED     others, so well that no fault of a range, or of a satellite in all its ranges, moves the fix by
               more than 5.33 of its sigmas and stays unseen, but for one in twenty of the worst there are
    """

    UNTESTED = _TESTED["UNTESTED"]
    CHECKED = _TESTED["CHECKED"]
    TESTED = _TESTED["TESTED"]


class FixMode(IntEnum):
    """What a solution has, as in the contract's value table."""

    NO_FIX = _NAV_MODE["NO_FIX"]
    POSITION = _NAV_MODE["POSITION"]
    POSITION_VELOCITY = _NAV_MODE["POSITION_VELOCITY"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fix:
    """An estimate for the point the lever arms are counted from, ECEF WGS-84, at the time mark.

    items        (c,) which clock each bias and drift is: a clock domain, or a system's time-offset item
    clock_m, drift_mps   (c,) clock minus GPS time and its rate, times c
    velocity_mps, drift_mps   None if the range rates contradict each other or the bus cannot carry them
    covariance_m2        (3, 3) of the position, by what the measurements are known to err by
    velocity_covariance_m2ps2, clock_variance_m2, drift_variance_m2ps2   (3, 3), (c,), (c,) likewise; None
                         where the navigator has none, or nothing that they belong to
    used         (n,) bool, which of the measurements offered are in the fix
    satellites   distinct ones among them
    residual_m   (n,) measured minus predicted pseudorange, nan where not used
    pdop         over the measurements used; None where the navigator has none: `estimation.dilution` does
    misfit       chi-square for each degree of freedom where ranges that disagree made the fix; else 1
    tested       whether a range that is wrong would have been seen
    """

    position_m: F64
    velocity_mps: F64 | None
    items: tuple[int, ...]
    clock_m: F64
    drift_mps: F64 | None
    covariance_m2: F64
    used: Bool
    satellites: int
    residual_m: F64
    pdop: float | None
    velocity_covariance_m2ps2: F64 | None = None
    clock_variance_m2: F64 | None = None
    drift_variance_m2ps2: F64 | None = None
    misfit: float = 1.0
    tested: Tested = Tested.UNTESTED


def without_motion(fix: Fix) -> Fix:
    """The fix without all it says of velocity and drifts."""
    return replace(
        fix, velocity_mps=None, drift_mps=None, velocity_covariance_m2ps2=None, drift_variance_m2ps2=None
    )


@dataclass(frozen=True, slots=True, eq=False)
class ReceiverDelays:
    """Of m receivers with their lines, one against another.

    mean_m (m,), and root_m (m, m): root_m root_m' is the covariance
    """

    mean_m: F64
    root_m: F64


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SnapshotFix(Fix):
    """What a least-squares solution of one epoch has besides.

    gain         (3, n) what a metre of each pseudorange moves the position, zero where not used
    velocity_gain   (3, n) likewise a metre a second of each range rate the velocity; None without one
    rate_misfit  as misfit, of the range rates; the covariance of the velocity has it already
    delays       of receivers, as they are known after it; None where they are not learnt
    iterations   Gauss-Newton steps taken
    """

    pdop: float
    gain: F64
    iterations: int
    velocity_gain: F64 | None = None
    rate_misfit: float = 1.0
    delays: ReceiverDelays | None = None


@dataclass(frozen=True, slots=True, eq=False)
class OrbitState:
    """Where the craft is, by the last fix or propagated from it; ECEF.

    velocity_mps   of the last fix that had one, propagated; None if there was none
    fix_ns         GPS time of the last fix [ns]
    covariance_m2, velocity_covariance_m2ps2   (3, 3) at the last fix; None where that is not known
    trusted_s      so long after its fix it is asked whether measurements agree with it
    checked        whether anything would have contradicted its fix if that were wrong
    """

    t_ns: int
    position_m: F64
    velocity_mps: F64 | None
    fix_ns: int
    covariance_m2: F64 | None = None
    velocity_covariance_m2ps2: F64 | None = None
    trusted_s: float = 0.0
    checked: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Of one epoch.

    reason   FIX, or why there is none
    fix      the estimate; None where reason is not FIX
    orbit    position and velocity to point antennas by: of the fix, or propagated; None without one

    SolutionError where reason and fix contradict each other.
    """

    reason: NoFix
    fix: Fix | None = None
    orbit: OrbitState | None = None

    def __post_init__(self) -> None:
        if (self.reason is _FIX) is (self.fix is None):
            with_fix = "without" if self.fix is None else "with"
            raise SolutionError(f"reason: {self.reason!r} {with_fix} a fix")

    @property
    def mode(self) -> FixMode:
        if self.fix is None:
            return FixMode.NO_FIX
        return FixMode.POSITION if self.fix.velocity_mps is None else FixMode.POSITION_VELOCITY


def carriable(position_m: F64, clock_m: F64) -> bool:
    """Whether the bus can carry a position (3,) and clocks (c,); an estimate beyond is no fix."""
    return within(position_m.tolist() + clock_m.tolist(), FARTHEST_M)


def within(values: Sequence[float], limit: float) -> bool:
    """Whether none is larger than a limit, either way; what is no number is not within."""
    # If their root sum square is not larger, none is: one call for nearly all there are.
    return hypot(*values) <= limit or all([abs(value) <= limit for value in values])
