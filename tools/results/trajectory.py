"""Where a craft truly was at a time that need not be an epoch's: by the rows of truth around it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.gpstime import NS_PER_S

MAX_GAP_NS = 60 * NS_PER_S
"""Between rows farther apart than that nothing is interpolated. A cubic errs by the fourth derivative of the
motion times gap^4 / 384, in a low orbit by 0.4 m at 60 s, 0.3 mm at 10 s."""

REACH_NS = 10 * NS_PER_S
"""So far beyond the first and the last row, and not farther than the two rows that it goes by are apart."""


def states(t_ns: I64, position_m: F64, velocity_mps: F64, at_ns: I64) -> tuple[F64, F64]:
    """Positions and velocities (k, 3) at instants (k,), nan where they are not known.

    t_ns, position_m, velocity_mps   (n,), (n, 3), (n, 3): rows of truth by time, ECEF

    At an instant that has a row it is that row, to the bit. Between rows it is the cubic through position and
    velocity of both sides; beyond the ends the cubic of the first or last ten seconds, for ten more.
    """
    if not len(t_ns):
        return np.full((len(at_ns), 3), np.nan), np.full((len(at_ns), 3), np.nan)
    low, high = _beside(t_ns, at_ns)
    span_ns = t_ns[high] - t_ns[low]
    beyond_ns = np.maximum(np.maximum(t_ns[low] - at_ns, at_ns - t_ns[high]), 0)
    known = (span_ns > 0) & (span_ns <= MAX_GAP_NS) & (beyond_ns <= np.minimum(REACH_NS, span_ns))
    span_s = np.where(known, span_ns, np.nan)[:, None] / NS_PER_S
    since_s = (at_ns - t_ns[low])[:, None] / NS_PER_S
    position, velocity = _cubic(
        (position_m[low], velocity_mps[low]), (position_m[high], velocity_mps[high]), span_s, since_s
    )
    own = np.minimum(np.searchsorted(t_ns, at_ns), len(t_ns) - 1)
    same = (t_ns[own] == at_ns)[:, None]
    return np.where(same, position_m[own], position), np.where(same, velocity_mps[own], velocity)


_AXES = tuple(f"{a}_ecef_m" for a in "xyz"), tuple(f"v{a}_ecef_mps" for a in "xyz")
COLUMNS = ("t_gps_s", *_AXES[0], *_AXES[1])
"""Of truth.parquet, what is needed."""


def of_table(truth: Mapping[str, NDArray], t_gps_s: F64) -> tuple[F64, F64]:
    """`states` of a craft's rows of truth.parquet, at instants as tables have them, to 0.24 us: 2 mm in a low
    orbit, where there is no row."""
    position, velocity = (np.column_stack([truth[axis] for axis in axes]) for axes in _AXES)
    return states(_whole_ns(truth["t_gps_s"]), position, velocity, _whole_ns(t_gps_s))


def _whole_ns(t_gps_s: F64) -> I64:
    return np.round(np.asarray(t_gps_s, float) * NS_PER_S).astype(np.int64)


def _beside(t_ns: I64, at_ns: I64) -> tuple[I64, I64]:
    """The rows (k,) that instants are interpolated by: those on both sides, beyond the ends two that are as
    far apart as it may reach."""
    last = len(t_ns) - 1
    after = np.searchsorted(t_ns, at_ns)
    early, late = np.searchsorted(t_ns, (t_ns[0] + REACH_NS, t_ns[-1] - REACH_NS + 1))
    low = np.where(after > last, max(late - 1, 0), np.maximum(after - 1, 0))
    high = np.where(after == 0, min(early, last), np.minimum(after, last))
    return low, high


def _cubic(begin: tuple[F64, F64], end: tuple[F64, F64], span_s: F64, since_s: F64) -> tuple[F64, F64]:
    """Positions and velocities (k, 3) so long after the begin of spans, by those of both of their ends."""
    (at_m, moving_mps), (to_m, arriving_mps) = begin, end
    mean_mps = (to_m - at_m) / span_s
    bend = (3 * mean_mps - 2 * moving_mps - arriving_mps) / span_s
    twist = (moving_mps + arriving_mps - 2 * mean_mps) / span_s**2
    position = at_m + since_s * (moving_mps + since_s * (bend + since_s * twist))
    return position, moving_mps + since_s * (2 * bend + 3 * since_s * twist)
