"""Where a craft was, by a file's account: tabulated states read as a smooth orbit.

A table's positions are turned into ECEF, by the Earth's measured orientation where a run has one, and joined
by Lagrange's polynomials of the nearest points, which the bench's own table of Chebyshev polynomials then
samples: reading an instant costs as little as that of an orbit of our own, and its derivatives are those of
one function.
"""

from __future__ import annotations

from collections.abc import Callable
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


def lagrange(t_s: F64, values: F64, at_s: F64, points: int = POINTS) -> F64:
    """Values (q, w) at times at_s (q,) from those (n, w) at t_s (n,), ascending, not necessarily evenly.

    Lagrange's polynomial through the `points` nearest, in barycentric form.
    Source: Berrut & Trefethen, "Barycentric Lagrange Interpolation", SIAM Review 46 (2004), eq. 4.2
    """
    points = min(points, len(t_s))
    middle = np.searchsorted(t_s, at_s) - points // 2
    first = np.clip(middle, 0, len(t_s) - points)
    rows = first[:, None] + np.arange(points)
    nodes = t_s[rows]
    apart = nodes[:, :, None] - nodes[:, None, :]
    apart[:, np.arange(points), np.arange(points)] = 1.0
    away = at_s[:, None] - nodes
    hit = away == 0
    weights = 1 / (apart.prod(axis=2) * np.where(hit, 1.0, away))
    weights = np.where(hit.any(axis=1)[:, None], hit, weights)
    return np.einsum("qp,qpw->qw", weights, values[rows]) / weights.sum(axis=1)[:, None]


class Trajectory:
    """An orbit by its table of positions in ECEF.

    t_ns        (n,) GPS time [ns], ascending
    pos_ecef_m  (n, 3) [m]
    """

    def __init__(self, t_ns: I64, pos_ecef_m: F64):
        self.span_ns = int(t_ns[0]), int(t_ns[-1])
        self._t_s = (t_ns - t_ns[0]) / NS_PER_S
        self._pos_ecef_m = pos_ecef_m
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

    def _sample(self, chunk: int) -> F64:
        middles_ns = self._grid.middles_ns(chunk)
        at_s = ((middles_ns - self.span_ns[0]) / NS_PER_S)[:, None] + self._grid.nodes_s
        # The last chunk has segments beyond the table; they are never read.
        inside = np.clip(at_s, 0.0, self._end_s)
        return lagrange(self._t_s, self._pos_ecef_m, inside.ravel()).reshape(*at_s.shape, 3)

    def check(self, begin_ns: int, end_ns: int, origin: str) -> None:
        """TrajectoryError unless the table holds all of a run."""
        first, last = self.span_ns
        if begin_ns < first or end_ns > last:
            raise TrajectoryError(
                f"{origin}: states from {gpstime.iso(first)} to {gpstime.iso(last)}; the run is from "
                f"{gpstime.iso(begin_ns)} to {gpstime.iso(end_ns)} (GPS time)"
            )


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


def of_ephemeris(ephemeris: Ephemeris, origin: str, measured: Orientation | None = None) -> Trajectory:
    """The orbit of an ephemeris message; TrajectoryError if its frame is none of FRAMES."""
    stem = (
        ephemeris.frame if ephemeris.frame in FRAMES else ephemeris.frame.split("-")[0].rstrip("0123456789")
    )
    if stem not in FRAMES:
        raise TrajectoryError(f"{origin}: REF_FRAME is {ephemeris.frame}; allowed are {', '.join(FRAMES)}")
    return Trajectory(ephemeris.t_ns, in_ecef(stem, ephemeris.t_ns, ephemeris.pos_m, measured))


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
    return Trajectory(t_ns, in_ecef("TEME", t_ns, 1e3 * pos_km, measured))
