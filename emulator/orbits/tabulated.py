"""Orbits from tables of states, and how far they can be believed.

What a table lacks is refused or told: states so far apart that the polynomials between them are a guess,
velocities that its positions do not have, a motion that the Earth's pull does not explain (units, axes,
centre, time). Judged is what a run uses of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.config.tables import Tell, untold
from gnss_hil.emulator.earth.constants import MU_M3PS2, ROTATION_RPS, eci_to_ecef
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.files.oem import Ephemeris
from gnss_hil.emulator.orbits.trajectory import (
    FRAMES,
    POINTS,
    Segments,
    Trajectory,
    TrajectoryError,
    frame_of,
    in_ecef,
    velocities_in_ecef,
)

FINE_M = 1.0
"""A doubt that is not worth a word. From here on velocities help, where a table has them."""

_HOPELESS = 0.01
"""Doubt, as a share of the distance from the Earth's centre, from which on a table is no orbit."""

NEAREST_M, FARTHEST_M = 6.2e6, 2e9
"""From the Earth's centre: states beyond are in other units, or about something else."""

_STRANGE = 0.03
"""Share of gravity's pull by which a free orbit never differs from it: the bulge makes 0.2 %."""

_NO_CRAFT = 5.0
"""The same from which on no thrust explains it."""

_FREE_BELOW_M = 1e8
"""Farther out, Sun and Moon have their part."""

_ARC_NS = 120 * gpstime.NS_PER_S
"""Over which an orbit's fall is measured: metres of rounding do not matter, the pull hardly changes."""

_VELOCITY_SHARE, _VELOCITY_MPS = 1e-3, 1.0
"""Rounding, and what else velocities and positions may differ by."""

_SAMPLES = 200

Span = tuple[int, int]
"""GPS time of a run's first instant and of its last [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """A stretch of a table without a break.

    t_ns          (n,) GPS time, ascending [ns]
    pos_ecef_m    (n, 3) [m]
    vel_ecef_mps  rows (k,) -> velocities (k, 3) relative to ECEF [m/s], None where the table has none; asked
                  of few rows as a rule, since each costs its precession and nutation
    useable_ns    from when until when it is for use
    """

    t_ns: I64
    pos_ecef_m: F64
    vel_ecef_mps: Callable[[I64], F64] | None
    useable_ns: Span


@dataclass(frozen=True, slots=True)
class Wanted:
    """What of a table is wanted.

    origin    where it is from, for messages
    measured  the Earth's orientation, None without a file of it
    span_ns   the run; None: all of the table
    tell      takes remarks
    whole     a gap between segments in the run is a fault, else it is told; so is one before or after all
              segments, which else is the caller's to tell
    """

    origin: str
    measured: Orientation | None = None
    span_ns: Span | None = None
    tell: Tell = untold
    whole: bool = True

    def remark(self, text: str) -> None:
        self.tell(f"{self.origin}: {text}")

    def fault(self, text: str) -> TrajectoryError:
        return TrajectoryError(f"{self.origin}: {text}")


def of_ephemeris(ephemeris: Ephemeris, wanted: Wanted) -> Segments:
    """The orbit of an ephemeris message; TrajectoryError if there is none."""
    frame, measured = frame_of(ephemeris, wanted.origin), wanted.measured
    bounds, parts, absent = [*ephemeris.begins, len(ephemeris.t_ns)], [], 0
    for number, (begin, end) in enumerate(pairwise(bounds)):
        there = begin + np.flatnonzero(_present(ephemeris.pos_m[begin:end]))
        absent += end - begin - len(there)
        if len(there) < 2:
            continue
        t_ns = ephemeris.t_ns[there]
        useable_ns = ephemeris.useable_ns[number] if ephemeris.useable_ns else (int(t_ns[0]), int(t_ns[-1]))
        there = there[_near(t_ns, wanted.span_ns)]
        t_ns, pos_m, vel_mps = ephemeris.t_ns[there], ephemeris.pos_m[there], ephemeris.vel_mps[there]
        moving = partial(_moving, frame, t_ns, pos_m, vel_mps, measured) if _present(vel_mps).all() else None
        parts.append(States(t_ns, in_ecef(frame, t_ns, pos_m, measured), moving, useable_ns))
    return _believed(parts, absent, wanted)


def of_table(t_ns: I64, pos_m: F64, frame: str, wanted: Wanted) -> Segments:
    """The orbit of positions (n, 3) [m] at GPS times t_ns (n,), in one of `trajectory.FRAMES`."""
    assert frame in FRAMES
    there = _present(pos_m)
    t_ns, pos_m = t_ns[there], pos_m[there]
    parts = []
    if len(t_ns) > 1:
        useable_ns, near = (int(t_ns[0]), int(t_ns[-1])), _near(t_ns, wanted.span_ns)
        t_ns, pos_m = t_ns[near], pos_m[near]
        parts = [States(t_ns, in_ecef(frame, t_ns, pos_m, wanted.measured), None, useable_ns)]
    return _believed(parts, int(np.count_nonzero(~there)), wanted)


def _near(t_ns: I64, span_ns: Span | None) -> slice:
    """The rows of a table t_ns (n,) that a run needs: its own and, on either side, as many as a polynomial
    and a judgement of it take; two at least. Turning one to the Earth's axes costs 50 us."""
    if span_ns is None:
        return slice(None)
    before, behind = np.searchsorted(t_ns, (span_ns[0] - _ARC_NS, span_ns[1] + _ARC_NS))
    first = min(max(int(before) - 2 * POINTS, 0), len(t_ns) - 2)
    return slice(first, max(int(behind) + 2 * POINTS, first + 2))


def _moving(frame: str, t_ns: I64, pos_m: F64, vel_mps: F64, measured: Orientation | None, rows: I64) -> F64:
    return velocities_in_ecef(frame, t_ns[rows], pos_m[rows], vel_mps[rows], measured)


def _present(vectors: F64) -> Bool:
    """(n,) whether vectors (n, 3) are states at all: three zeros, or three times nines, stand for none."""
    return ~((vectors[:, 0] == vectors[:, 1]) & (vectors[:, 1] == vectors[:, 2]))


def _believed(parts: Sequence[States], absent: int, wanted: Wanted) -> Segments:
    """The orbit of stretches, judged; so many states of the table are none."""
    if not parts:
        raise wanted.fault("fewer than two states; an orbit needs two at least")
    for part in parts:
        _check_distance(part, wanted)
    if absent:
        wanted.remark(f"{absent} states are left out: the same number three times is none")
    arcs = [Trajectory(part.t_ns, part.pos_ecef_m) for part in parts]
    found = Segments(arcs, [part.useable_ns for part in parts])
    begin_ns, end_ns = wanted.span_ns or found.span_ns
    if wanted.span_ns:
        found.check(begin_ns, end_ns, wanted.origin, wanted.whole)
        _judge_gaps(found, wanted.span_ns, wanted)
    for number, part in enumerate(parts):
        used_ns = max(begin_ns, part.useable_ns[0]), min(end_ns, part.useable_ns[1])
        if used_ns[0] <= used_ns[1]:
            arcs[number] = _best(part, used_ns)
            _judge(part, arcs[number], used_ns, wanted)
    best = Segments(arcs, found.useable_ns)
    _judge_overlaps(best, (begin_ns, end_ns), wanted)
    return best


def _judge_overlaps(found: Segments, span_ns: Span, wanted: Wanted) -> None:
    """Tell of segments that are of other orbits where they overlap in a run."""
    for number, (first_ns, last_ns) in enumerate(found.useable_ns):
        for later in range(number + 1, len(found.arcs)):
            begin_ns = max(first_ns, found.useable_ns[later][0], span_ns[0])
            end_ns = min(last_ns, found.useable_ns[later][1], span_ns[1])
            if begin_ns >= end_ns:
                continue
            t_ns = np.linspace(begin_ns, end_ns, 9).astype(np.int64)
            one, other = (found.arcs[k].over(t_ns).pos_ecef_m for k in (number, later))
            apart_m = np.linalg.norm(one - other, axis=1).max()
            if apart_m > FINE_M:
                begin, end = map(gpstime.iso, (begin_ns, end_ns))
                wanted.remark(
                    f"segments overlap from {begin} to {end} GPS and are up to {_length(apart_m)} "
                    "apart: the later one counts"
                )


def _judge_gaps(found: Segments, span_ns: Span, wanted: Wanted) -> None:
    """TrajectoryError if a run that needs all of an orbit is in a gap between segments; else it is told."""
    for gap_ns in found.gaps_ns(*span_ns):
        held, first, begin, end = map(gpstime.iso, (*gap_ns, *span_ns))
        said = f"no state between {held} and {first}, where one segment ends and the next begins"
        if wanted.whole:
            raise wanted.fault(f"{said}; the run is from {begin} to {end} (GPS time)")
        wanted.remark(f"{said}: nothing is known there")


def _check_distance(part: States, wanted: Wanted) -> None:
    distance_m = np.linalg.norm(part.pos_ecef_m, axis=1)
    odd = np.flatnonzero((distance_m < NEAREST_M) | (distance_m > FARTHEST_M))
    if len(odd):
        when, km = gpstime.iso(int(part.t_ns[odd[0]])), distance_m[odd[0]] / 1e3
        raise wanted.fault(
            f"at {when} GPS the craft is {km:.7g} km from the Earth's centre: are units and centre "
            f"right? Allowed are {NEAREST_M / 1e3:g} to {FARTHEST_M / 1e3:g} km"
        )


def _best(part: States, used_ns: Span) -> Trajectory:
    """By positions, as long as they do; else by the velocities too, if so the doubt is a tenth or less."""
    arc = Trajectory(part.t_ns, part.pos_ecef_m)
    instants = _instants(part.t_ns, used_ns)
    doubt_m = arc.doubt_m(instants).max()
    if part.vel_ecef_mps is None or doubt_m <= FINE_M:
        return arc
    moving = Trajectory(part.t_ns, part.pos_ecef_m, part.vel_ecef_mps(np.arange(len(part.t_ns))))
    return moving if moving.doubt_m(instants).max() < 0.1 * doubt_m else arc


def _instants(t_ns: I64, used_ns: Span) -> I64:
    """GPS times (q,) at which a table t_ns (n,) is tried within what is used: in the middle between two
    states, of all or of many, the longest steps among them."""
    begin, end = used_ns
    first, last = np.searchsorted(t_ns, used_ns) + np.array((-1, 1))
    inside = t_ns[max(first, 0) : last]
    steps = np.diff(inside)
    evenly = np.linspace(0, len(steps) - 1, min(len(steps), _SAMPLES)).astype(np.int64)
    chosen = np.union1d(evenly, np.argsort(steps)[-_SAMPLES:])
    middles = inside[chosen] + steps[chosen] // 2
    return np.clip(np.append(middles, (begin, (begin + end) // 2, end)), begin, end)


def _judge(part: States, arc: Trajectory, used_ns: Span, wanted: Wanted) -> None:
    instants = _instants(part.t_ns, used_ns)
    doubt_m = arc.doubt_m(instants)
    worst = int(np.argmax(doubt_m))
    if doubt_m[worst] > FINE_M:
        row = np.clip(np.searchsorted(part.t_ns, instants[worst]), 1, len(part.t_ns) - 1)
        step_s = (part.t_ns[row] - part.t_ns[row - 1]) / gpstime.NS_PER_S
        when = gpstime.iso(int(instants[worst]))
        said = (
            f"at {when} GPS states are {step_s:g} s apart, too coarse a step or not of one orbit: "
            f"the place is uncertain by some {_length(doubt_m[worst])}"
        )
        if doubt_m[worst] > _HOPELESS * np.linalg.norm(part.pos_ecef_m[row]):
            raise wanted.fault(said)
        wanted.remark(said)
    _judge_velocities(part, arc, used_ns, wanted)
    _judge_fall(arc, used_ns, wanted)


def _length(metres: float) -> str:
    return f"{metres / 1e3:.3g} km" if metres >= 1e3 else f"{metres:.3g} m"


def _judge_velocities(part: States, arc: Trajectory, used_ns: Span, wanted: Wanted) -> None:
    """Tell of velocities that are not those of the positions."""
    if part.vel_ecef_mps is None:
        return
    rows = np.flatnonzero((part.t_ns >= used_ns[0]) & (part.t_ns <= used_ns[1]))
    if not len(rows):
        rows = np.clip(np.searchsorted(part.t_ns, used_ns[:1]), 0, len(part.t_ns) - 1)
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), _SAMPLES)).astype(np.int64)]
    flown_mps, said_mps = arc.over(part.t_ns[rows]).vel_ecef_mps, part.vel_ecef_mps(rows)
    off_mps = np.linalg.norm(flown_mps - said_mps, axis=1)
    allowed_mps = np.maximum(_VELOCITY_MPS, _VELOCITY_SHARE * np.linalg.norm(flown_mps, axis=1))
    worst = int(np.argmax(off_mps - allowed_mps))
    if off_mps[worst] > allowed_mps[worst]:
        when = gpstime.iso(int(part.t_ns[rows[worst]]))
        wanted.remark(
            f"at {when} GPS the velocity written is {off_mps[worst]:.4g} m/s off that of the "
            "positions, which are flown: are units, axes and times right?"
        )


def _judge_fall(arc: Trajectory, used_ns: Span, wanted: Wanted) -> None:
    """Tell of a motion that the Earth's pull does not explain, by what it did over some minutes."""
    first_ns, last_ns = arc.span_ns
    half_ns = min(_ARC_NS, (last_ns - first_ns) // 2)
    middles_ns = np.clip(np.linspace(*used_ns, 9).astype(np.int64), first_ns + half_ns, last_ns - half_ns)
    since_ns = np.rint(np.linspace(-half_ns, half_ns, 9)).astype(np.int64)
    half_s = half_ns / gpstime.NS_PER_S
    share = max(unexplained(arc.over(t_ns + since_ns).pos_ecef_m, half_s) for t_ns in np.unique(middles_ns))
    if share > _STRANGE:
        said = (
            f"the craft's motion differs from a free fall about the Earth by up to {share:.0%} of "
            "gravity: unless it is under thrust, are units, axes, centre and times right?"
        )
        if share > _NO_CRAFT:
            raise wanted.fault(said)
        wanted.remark(said)


def unexplained(pos_ecef_m: F64, half_s: float) -> float:
    """How far a fall is off the Earth's pull, as a share of the pull; 0 where others pull too.

    pos_ecef_m  (9, 3) evenly from half_s before an instant to half_s after it, in ECEF of each [m]
    The second difference of the outer and the middle place is held against the pull of a ball, averaged in
    the same way.
    """
    since = np.linspace(-1, 1, 9)
    pos_m = eci_to_ecef(pos_ecef_m, -ROTATION_RPS * half_s * since)
    distance_m = np.linalg.norm(pos_m, axis=1)
    if distance_m.max() > _FREE_BELOW_M:
        return 0.0
    pull = -MU_M3PS2 * pos_m / distance_m[:, None] ** 3
    # r(t+h) - 2 r(t) + r(t-h) is the integral of (h - |s|) a(t+s), by Simpson's rule: its bend is at a node
    # where two parabolas meet.
    simpson = np.array((1, 4, 2, 4, 2, 4, 2, 4, 1)) / 12
    averaged = (simpson * (1 - np.abs(since))) @ pull
    fallen = (pos_m[0] - 2 * pos_m[4] + pos_m[-1]) / half_s**2
    return float(np.linalg.norm(fallen - averaged) / np.linalg.norm(averaged))
