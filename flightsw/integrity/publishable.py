"""Nothing leaves a navigator that is no solution: numbers that are none, that no bus carries, variances that
are negative.

A navigator may be anybody's, and a filter that diverges says so in no other way. What it makes of
measurements is judged, and refused with a reason. What only its author can have got wrong, arrays of another
shape, is an error that names the field.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.records.solution import (
    FARTHEST_M,
    FASTEST_MPS,
    Fix,
    NoFix,
    OrbitState,
    Solution,
    SolutionError,
    carriable,
    within,
    without_motion,
)

_WIDEST_M2 = FARTHEST_M**2
"""A position that may be anywhere is none."""

_FASTEST_M2PS2 = FASTEST_MPS**2
"""Likewise a velocity that may be any."""

_ROUNDING = 1 + 1e-9
"""So much larger the square of a full correlation may come out."""


def publishable(solution: Solution, rows: int) -> Solution:
    """A solution of `rows` measurements, as it may be published and antennas may be pointed by it.

    A fix whose position, clocks, their variances or dilution are nonsense is none: NO_CONVERGENCE, without an
    orbit, which would be that of the fix. A velocity or drifts that are nonsense, or variances of them, leave
    no velocity. An orbit is judged as a fix is.

    SolutionError names what has another shape or type than `records.solution.Fix` and `OrbitState` say.
    """
    fix, orbit = solution.fix, solution.orbit
    if fix is None:
        pointing = _pointing(orbit)
        return solution if pointing is orbit else replace(solution, orbit=pointing)
    if not _well_shaped(fix, rows):
        raise SolutionError(_misshapen(fix, rows))
    position, velocity, drift = fix.position_m, fix.velocity_mps, fix.drift_mps
    sound = carriable(position, fix.clock_m) and _positive(fix.covariance_m2, _WIDEST_M2)
    sound = sound and _variances(fix.clock_variance_m2, _WIDEST_M2)
    if not (sound and (fix.pdop is None or 0 <= fix.pdop < inf)):
        return Solution(NoFix.NO_CONVERGENCE)
    if velocity is not None and drift is not None and not _moves(fix, velocity, drift):
        fix = without_motion(fix)
    elif orbit is not None and orbit.position_m is position and orbit.velocity_mps is velocity:
        return solution  # as most are: the orbit is that of the fix, and judged
    return replace(solution, fix=fix, orbit=_pointing(orbit))


def _pointing(orbit: OrbitState | None) -> OrbitState | None:
    """What is left of an orbit to point antennas by; itself where it is sound."""
    if orbit is None:
        return None
    position, velocity = orbit.position_m, orbit.velocity_mps
    for name, value in (("orbit.position_m", position), ("orbit.velocity_mps", velocity)):
        if value is not None and (wrong := _not_of(value, (3,))):
            raise SolutionError(f"{name}: {wrong}")
    if not within(position.tolist(), FARTHEST_M):
        return None
    moves = velocity is None or within(velocity.tolist(), FASTEST_MPS)
    return orbit if moves else replace(orbit, velocity_mps=None)


def _moves(fix: Fix, velocity: F64, drift: F64) -> bool:
    """Whether the bus can carry velocity and drifts, and how far they are known."""
    covariance = fix.velocity_covariance_m2ps2
    return (
        within(velocity.tolist() + drift.tolist(), FASTEST_MPS)
        and (covariance is None or _positive(covariance, _FASTEST_M2PS2))
        and _variances(fix.drift_variance_m2ps2, _FASTEST_M2PS2)
    )


def _variances(values: F64 | None, widest: float) -> bool:
    """Whether variances (c,), if there are any, are some; False where one is no number."""
    return values is None or all([0 <= value <= widest for value in values.tolist()])


def _positive(covariance: F64, widest: float) -> bool:
    """Whether the diagonal is positive and no correlation beyond 1; False where one is no number."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = covariance.tolist()
    return (
        0 < xx <= widest
        and 0 < yy <= widest
        and 0 < zz <= widest
        and xy * xy <= xx * yy * _ROUNDING
        and xz * xz <= xx * zz * _ROUNDING
        and yz * yz <= yy * zz * _ROUNDING
    )


def _well_shaped(fix: Fix, rows: int) -> bool:
    """Whether all is as the record says: by axes, clocks, and measurements offered."""
    clocks, velocity, drift = (len(fix.items),), fix.velocity_mps, fix.drift_mps
    try:
        return (
            fix.position_m.shape == (3,)
            and fix.clock_m.shape == clocks
            and fix.covariance_m2.shape == (3, 3)
            and fix.used.shape == fix.residual_m.shape == (rows,)
            and fix.used.dtype.kind == "b"
            and _is(fix.clock_variance_m2, clocks)
            and (
                velocity is drift is fix.velocity_covariance_m2ps2 is fix.drift_variance_m2ps2  # all None
                if velocity is None or drift is None
                else velocity.shape == (3,)
                and drift.shape == clocks
                and _is(fix.velocity_covariance_m2ps2, (3, 3))
                and _is(fix.drift_variance_m2ps2, clocks)
            )
        )
    except AttributeError:
        return False


def _is(value: F64 | None, shape: tuple[int, ...]) -> bool:
    """Whether what a navigator need not have is of a shape."""
    return value is None or value.shape == shape


def _misshapen(fix: Fix, rows: int) -> str:
    """What is not as the record says, at length."""
    axes, clocks, offered = (3,), (len(fix.items),), (rows,)
    shapes = {"position_m": axes, "clock_m": clocks, "covariance_m2": (3, 3), "used": offered}
    shapes["residual_m"] = offered
    if fix.velocity_mps is not None or fix.drift_mps is not None:
        shapes |= {"velocity_mps": axes, "drift_mps": clocks}
    of_motion = {"velocity_covariance_m2ps2": (3, 3), "drift_variance_m2ps2": clocks}
    may = {"clock_variance_m2": clocks, **of_motion}
    shapes |= {name: shape for name, shape in may.items() if getattr(fix, name) is not None}
    wrong = {name: _not_of(getattr(fix, name), shape) for name, shape in shapes.items()}
    if fix.velocity_mps is None and fix.drift_mps is None:
        wrong |= {name: "of a fix without velocity" for name in of_motion if getattr(fix, name) is not None}
    found = [f"{name}: {what}" for name, what in wrong.items() if what]
    return "; ".join(found) or f"used: of {fix.used.dtype}, has to be of bool"


def _not_of(value: object, shape: tuple[int, ...]) -> str:
    """What is wrong with an array, empty if nothing is."""
    found = getattr(value, "shape", None)
    if found == shape:
        return ""
    what = f"no array but {type(value).__name__}" if found is None else f"of shape {found}"
    return f"{what}, has to be of shape {shape}"
