"""Where a craft was, by a file's account: tabulated states read as a smooth orbit.

A table's positions are turned into ECEF, by the Earth's measured orientation where a run has one, and joined
by Lagrange's polynomials of the nearest points (Hermite's, where positions alone are too coarse and the table
has velocities), which the bench's own table of Chebyshev polynomials then samples: reading an instant costs
as little as that of an orbit of our own, and its derivatives are those of one function. Nothing is joined
across the segments of a message. How far a table can be believed: `gnss_hil.emulator.orbits.tabulated`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from math import ceil

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.files.finals import Orientation
from gnss_hil.emulator.files.oem import Ephemeris
from gnss_hil.emulator.numerics.chebyshev import NS_PER_S, Grid, Table
from gnss_hil.emulator.orbits.dynamics import CraftState

POINTS = 10
"""Of a low orbit at 4 min between points: some millimetres; at 1 min: nothing."""

SEGMENT_NS = 60 * NS_PER_S
"""About as long is a segment of the table of polynomials: a table of states is cut into equal ones, because
one that reached beyond it would have nothing to be fitted to there."""


class TrajectoryError(ValueError):
    """A trajectory that cannot be used; the message is for people."""


def window(t_s: F64, at_s: F64, points: int) -> I64:
    """Rows (q, points) of the times t_s (n,), ascending, that are nearest to at_s (q,)."""
    middle = np.searchsorted(t_s, at_s) - points // 2
    return np.clip(middle, 0, len(t_s) - points)[:, None] + np.arange(points)


def lagrange(t_s: F64, values: F64, at_s: F64, points: int = POINTS) -> F64:
    """Values (q, w) at times at_s (q,) from those (n, w) at t_s (n,), ascending, not necessarily evenly.

    Lagrange's polynomial through the `points` nearest, in barycentric form.
    Source: Berrut & Trefethen, "Barycentric Lagrange Interpolation", SIAM Review 46 (2004), eq. 4.2
    """
    points = min(points, len(t_s))
    rows = window(t_s, at_s, points)
    nodes = t_s[rows]
    apart = nodes[:, :, None] - nodes[:, None, :]
    apart[:, np.arange(points), np.arange(points)] = 1.0
    away = at_s[:, None] - nodes
    hit = away == 0
    weights = 1 / (apart.prod(axis=2) * np.where(hit, 1.0, away))
    weights = np.where(hit.any(axis=1)[:, None], hit, weights)
    return np.einsum("qp,qpw->qw", weights, values[rows]) / weights.sum(axis=1)[:, None]


def hermite(t_s: F64, values: F64, slopes: F64, at_s: F64, points: int = POINTS) -> F64:
    """Values (q, w) as `lagrange` has them, by the polynomial that has the slopes (n, w) too.

    Source: Stoer & Bulirsch, Introduction to Numerical Analysis, 3rd ed., 2.1.5
    """
    points = min(points, len(t_s))
    rows = window(t_s, at_s, points)
    # Times in steps of the table keep products of many of them near one.
    step_s = (t_s[rows[:, -1]] - t_s[rows[:, 0]])[:, None] / max(points - 1, 1)
    nodes = (t_s[rows] - at_s[:, None]) / step_s
    apart = nodes[:, :, None] - nodes[:, None, :]
    diagonal = np.arange(points)
    apart[:, diagonal, diagonal] = 1.0
    ratios = -nodes[:, None, :] / apart
    ratios[:, diagonal, diagonal] = 1.0
    squares = ratios.prod(axis=2) ** 2
    slope_of_own = (1 / apart).sum(axis=2) - 1.0
    of_values = (1 + 2 * nodes * slope_of_own) * squares
    of_slopes = -nodes * squares * step_s
    return np.einsum("qp,qpw->qw", of_values, values[rows]) + np.einsum("qp,qpw->qw", of_slopes, slopes[rows])


class Trajectory:
    """An orbit by its table of positions in ECEF, without a break.

    t_ns          (n,) GPS time [ns], ascending
    pos_ecef_m    (n, 3) [m]
    vel_ecef_mps  (n, 3) [m/s], relative to ECEF; None leaves positions to tell the velocities
    """

    def __init__(self, t_ns: I64, pos_ecef_m: F64, vel_ecef_mps: F64 | None = None):
        self.span_ns = int(t_ns[0]), int(t_ns[-1])
        self.t_ns = t_ns
        self._t_s = (t_ns - t_ns[0]) / NS_PER_S
        self._pos_ecef_m, self._vel_ecef_mps = pos_ecef_m, vel_ecef_mps
        span_ns = self.span_ns[1] - self.span_ns[0]
        segments = max(1, round(span_ns / SEGMENT_NS))
        segment_ns = span_ns // segments + 1
        self._end_s = segments * segment_ns / NS_PER_S  # some nanoseconds beyond the last state
        self._grid = Grid(self.span_ns[0], segment_ns, margin_ns=0, degree=12, per_chunk=30)
        self._table = Table(self._grid, self._sample)

    def at(self, t_ns: int) -> CraftState:
        """State at GPS time t_ns."""
        return CraftState(*self._table.at(t_ns))

    def over(self, t_ns: I64) -> CraftState:
        """States (q, 3) at GPS times (q,)."""
        return CraftState(*self._table.over(t_ns).swapaxes(0, 1))

    def doubt_m(self, t_ns: I64) -> F64:
        """(q,) about how far positions at GPS times (q,) may be off at most: what two states less of the
        table make of them [m]."""
        at_s = (t_ns - self.span_ns[0]) / NS_PER_S
        points = min(POINTS, len(self._t_s))
        fewer = points - 2 if points > 3 else points - 1
        return np.linalg.norm(self._joined(at_s, points) - self._joined(at_s, fewer), axis=1)

    def _joined(self, at_s: F64, points: int) -> F64:
        if self._vel_ecef_mps is None:
            return lagrange(self._t_s, self._pos_ecef_m, at_s, points)
        return hermite(self._t_s, self._pos_ecef_m, self._vel_ecef_mps, at_s, points)

    def _sample(self, chunk: int) -> F64:
        middles_ns = self._grid.middles_ns(chunk)
        at_s = ((middles_ns - self.span_ns[0]) / NS_PER_S)[:, None] + self._grid.nodes_s
        # The last chunk has segments beyond the table; they are never read.
        inside = np.clip(at_s, 0.0, self._end_s)
        return self._joined(inside.ravel(), POINTS).reshape(*at_s.shape, 3)

    def holds(self, t_ns: int) -> bool:
        """Whether the table holds GPS time t_ns."""
        return self.span_ns[0] <= t_ns <= self.span_ns[1]

    def check(self, begin_ns: int, end_ns: int, origin: str, whole: bool = True) -> None:
        """TrajectoryError unless the table holds all of a run, or a part of it."""
        _check_span(self.span_ns, (begin_ns, end_ns), origin, whole)


def _check_span(held_ns: tuple[int, int], run_ns: tuple[int, int], origin: str, whole: bool) -> None:
    """TrajectoryError unless what is held reaches from a run's begin to its end; or into it, not `whole`."""
    first, last = run_ns if whole else run_ns[::-1]
    if first < held_ns[0] or last > held_ns[1]:
        raise _beyond(held_ns, run_ns, origin)


def _beyond(held_ns: tuple[int, int], run_ns: tuple[int, int], origin: str) -> TrajectoryError:
    (first, last), (begin, end) = (map(gpstime.iso, span) for span in (held_ns, run_ns))
    return TrajectoryError(
        f"{origin}: states from {first} to {last}; the run is from {begin} to {end} (GPS time)"
    )


class Segments:
    """An orbit in segments, each joined by itself; where two meet or overlap, the later one counts.

    arcs        by their begin
    useable_ns  from which GPS time and until which each is for use
    """

    def __init__(self, arcs: Sequence[Trajectory], useable_ns: Sequence[tuple[int, int]]):
        self.arcs, self.useable_ns = tuple(arcs), tuple(useable_ns)
        self.span_ns = self.useable_ns[0][0], max(last for _, last in self.useable_ns)
        self._begins = np.array([first for first, _ in self.useable_ns])

    def at(self, t_ns: int) -> CraftState:
        """State at GPS time t_ns."""
        return self.arcs[self._arc(np.array([t_ns]))[0]].at(t_ns)

    def over(self, t_ns: I64) -> CraftState:
        """States (q, 3) at GPS times (q,)."""
        arc = self._arc(t_ns)
        if (arc == arc[0]).all():
            return self.arcs[arc[0]].over(t_ns)
        out = np.empty((3, len(t_ns), 3))
        for number in np.unique(arc).tolist():
            state = self.arcs[number].over(t_ns[arc == number])
            out[:, arc == number] = state.pos_ecef_m, state.vel_ecef_mps, state.acc_ecef_mps2
        return CraftState(*out)

    def _arc(self, t_ns: I64) -> I64:
        """(q,) the last segment that has begun; one that has ended does not count where another goes on."""
        inside = np.array([(first <= t_ns) & (t_ns <= last) for first, last in self.useable_ns])
        begun = np.maximum(np.searchsorted(self._begins, t_ns, "right") - 1, 0)
        last_inside = len(self.arcs) - 1 - np.argmax(inside[::-1], axis=0)
        return np.where(inside.any(axis=0), last_inside, begun)

    def holds(self, t_ns: int) -> bool:
        """Whether a segment is for use at GPS time t_ns."""
        return any(first <= t_ns <= last for first, last in self.useable_ns)

    def gaps_ns(self, begin_ns: int, end_ns: int) -> Iterator[tuple[int, int]]:
        """GPS times between which a run from begin_ns to end_ns has no state [ns]."""
        held_ns = self.useable_ns[0][1]
        for first_ns, last_ns in self.useable_ns[1:]:
            if first_ns > held_ns and begin_ns < first_ns and end_ns > held_ns:
                yield held_ns, first_ns
            held_ns = max(held_ns, last_ns)

    @property
    def t_ns(self) -> I64:
        """(n,) GPS times of all states [ns]; where segments overlap they do not ascend."""
        return np.concatenate([arc.t_ns for arc in self.arcs])

    def check(self, begin_ns: int, end_ns: int, origin: str, whole: bool = True) -> None:
        """TrajectoryError unless the segments reach from a run's begin to its end, or into it."""
        _check_span(self.span_ns, (begin_ns, end_ns), origin, whole)


def _earth_fixed(t_ns: I64, measured: Orientation | None) -> F64:
    return np.broadcast_to(np.eye(3), (len(t_ns), 3, 3))


FRAMES: dict[str, Callable[[I64, Orientation | None], F64]] = {
    "EME2000": frames.ecef_from_eme2000, "J2000": frames.ecef_from_eme2000,
    "GCRF": frames.ecef_from_gcrs, "ICRF": frames.ecef_from_gcrs,
    "TEME": frames.ecef_from_teme,
    "ITRF": _earth_fixed, "WGS84": _earth_fixed, "GRC": _earth_fixed,
}  # fmt: skip
"""Name of a reference frame, without its year -> rotations (n, 3, 3) to ECEF at times (n,)."""


def in_ecef(frame: str, t_ns: I64, pos_m: F64, measured: Orientation | None) -> F64:
    """Positions (n, 3) [m] at times t_ns (n,), given in one of FRAMES, in ECEF."""
    return np.einsum("nij,nj->ni", FRAMES[frame](t_ns, measured), pos_m)


def velocities_in_ecef(frame: str, t_ns: I64, pos_m: F64, vel_mps: F64, measured: Orientation | None) -> F64:
    """Velocities (n, 3) [m/s] relative to the axes of one of FRAMES, relative to ECEF; positions as above."""
    half_ns = NS_PER_S // 2
    turning = FRAMES[frame](t_ns + half_ns, measured) - FRAMES[frame](t_ns - half_ns, measured)
    return in_ecef(frame, t_ns, vel_mps, measured) + np.einsum("nij,nj->ni", turning, pos_m)


def frame_of(ephemeris: Ephemeris, origin: str) -> str:
    """The row of FRAMES of a message; TrajectoryError if it has none."""
    if ephemeris.frame in FRAMES:
        return ephemeris.frame
    stem = _YEAR.sub("", ephemeris.frame)
    if stem not in FRAMES:
        raise TrajectoryError(f"{origin}: REF_FRAME is {ephemeris.frame}; allowed are {', '.join(FRAMES)}")
    return stem


_YEAR = re.compile(r"[-_ ]?\d+$")
"""Of the realization of a terrestrial frame."""


TLE_STEP_NS = 60 * NS_PER_S


def of_elements(
    line1: str, line2: str, begin_ns: int, end_ns: int, measured: Orientation | None = None
) -> Trajectory:
    """The orbit of two-line elements from begin_ns to end_ns, by SGP4.

    TrajectoryError where SGP4 finds none (decayed, or the elements are no orbit).
    Source: Vallado et al., Revisiting Spacetrack Report #3, AIAA 2006-6753, in the library `sgp4`
    """
    from sgp4.api import SGP4_ERRORS, Satrec

    satellite = Satrec.twoline2rv(line1, line2)
    steps = ceil((end_ns - begin_ns) / TLE_STEP_NS) + 2 * POINTS
    t_ns = begin_ns + (np.arange(steps) - POINTS) * TLE_STEP_NS
    error, pos_km, _ = satellite.sgp4_array(*frames.utc_jd(t_ns))
    if error.any():
        raise TrajectoryError(f"two-line elements: {SGP4_ERRORS[int(error[error > 0][0])]}")
    if not np.isfinite(pos_km).all():
        raise TrajectoryError("two-line elements: no orbit comes of them")
    return Trajectory(t_ns, in_ecef("TEME", t_ns, 1e3 * pos_km, measured))
