"""Which antenna held which satellite, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gnss_hil.dbc.common.arrays import I64


@dataclass(frozen=True, slots=True, eq=False)
class Holds:
    """Stretches of time in which a receiver measured a satellite without a break, (n,) each.

    begin_ns, end_ns   GPS time; the end is an epoch interval behind the last measurement
    """

    receiver: I64
    satellite: I64
    begin_ns: I64
    end_ns: I64

    def __len__(self) -> int:
        return len(self.begin_ns)

    def __getitem__(self, rows) -> Holds:
        return Holds(self.receiver[rows], self.satellite[rows], self.begin_ns[rows], self.end_ns[rows])


def holds(t_ns: I64, receiver: I64, satellite: I64, interval_ns: int) -> Holds:
    """Stretches from single measurements (n,) in any order; by receiver, satellite and time."""
    order = np.lexsort((t_ns, satellite, receiver))
    t_ns, receiver, satellite = t_ns[order], receiver[order], satellite[order]
    return bridged(Holds(receiver, satellite, t_ns, t_ns + interval_ns), interval_ns // 2)


def bridged(parts: Holds, break_ns: int) -> Holds:
    """Neighbours of the same receiver and satellite joined where the break between them is that short.

    parts   by receiver, satellite and time
    """
    if not len(parts):
        return parts
    new = (np.diff(parts.receiver) != 0) | (np.diff(parts.satellite) != 0)
    new |= parts.begin_ns[1:] - parts.end_ns[:-1] > break_ns
    first = np.r_[0, np.flatnonzero(new) + 1]
    last = np.r_[first[1:] - 1, len(parts) - 1]
    return Holds(parts.receiver[first], parts.satellite[first], parts.begin_ns[first], parts.end_ns[last])


def joined(parts: Sequence[Holds]) -> Holds:
    """One table of several."""
    names = ("receiver", "satellite", "begin_ns", "end_ns")
    return Holds(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """Stretches cut wherever another antenna takes up or lets go the same satellite.

    holds   (n,)
    share   (n,) antennas that hold the satellite at the time
    lane    (n,) 0-based place among them, by receiver
    """

    holds: Holds
    share: I64
    lane: I64


def lanes(whole: Holds) -> Lanes:
    """A satellite on one antenna fills its row of the chart; on k antennas at once, each has a k-th of it."""
    pieces, share, lane = [], [], []
    for satellite in np.unique(whole.satellite):
        rows = np.flatnonzero(whole.satellite == satellite)
        rows = rows[np.lexsort((whole.begin_ns[rows], whole.receiver[rows]))]
        cuts = np.unique(np.r_[whole.begin_ns[rows], whole.end_ns[rows]])
        first = np.searchsorted(cuts, whole.begin_ns[rows])
        last = np.searchsorted(cuts, whole.end_ns[rows])
        step = np.zeros(len(cuts) + 1, np.int64)
        np.add.at(step, first, 1)
        np.add.at(step, last, -1)
        count = np.cumsum(step)
        below = np.zeros(len(cuts), np.int64)  # lanes taken so far, in each piece
        for row, a, b in zip(rows, first, last, strict=True):
            changes = np.flatnonzero((np.diff(count[a:b]) != 0) | (np.diff(below[a:b]) != 0)) + a + 1
            edges = np.r_[a, changes, b]
            pieces += [(row, cuts[i], cuts[j]) for i, j in pairwise(edges)]
            share += count[edges[:-1]].tolist()
            lane += below[edges[:-1]].tolist()
            below[a:b] += 1
    row, begin, end = np.array(pieces, np.int64).reshape(-1, 3).T
    cut = Holds(whole.receiver[row], whole.satellite[row], begin, end)
    return Lanes(cut, np.array(share, np.int64), np.array(lane, np.int64))
