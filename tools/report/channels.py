"""What a report draws of one craft's channels: read from channels.parquet once, kept small."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.tools.report.decimate import BUCKETS, evenly
from gnss_hil.tools.report.residuals import Ranges
from gnss_hil.tools.report.sky_plot import Places
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.parquet import Labelled

_AXES = tuple(f"sv_{v}{a}_ecef_m{p}" for v, p in (("", ""), ("v", "ps")) for a in "xyz")
_NUMBERS = ("t_gps_s", "receiver", "cn0_dbhz", "pseudorange_m", "sv_clock_m", "used", *_AXES)
_EPOCHS_WITH_RANGES = 1500
"""Of a run, evenly spread; a day's ranges would be two million."""


@dataclass(frozen=True, slots=True, eq=False)
class Strength:
    """C/N0 of one receiver, (b,) rows: least, mean and greatest of its channels [dBHz], by time."""

    t_ns: I64
    least: F64
    mean: F64
    greatest: F64


@dataclass(frozen=True, slots=True, eq=False)
class Channels:
    """Measurements of one craft, (n,) rows: a day has millions, so that each takes ten bytes.

    marks_ns   (e,) the time marks
    mark       row of the time mark
    receiver, satellite, cn0_dbhz
    ranges     code ranges of the systems' first signals, at `looked_at` marks that are evenly spread
    seen       places of the satellites measured at the instants that are looked at, and by which receivers
    """

    marks_ns: I64
    mark: NDArray[np.int32]
    receiver: NDArray[np.uint8]
    satellite: NDArray[np.int16]
    cn0_dbhz: NDArray[np.float32]
    seen: Places
    seen_by: I64
    ranges: Ranges
    looked_at: int

    def tracked(self, receiver: int) -> tuple[I64, I64, I64]:
        """t_ns, receiver, satellite of every measurement of one receiver."""
        mine = self.receiver == receiver
        satellite = self.satellite[mine].astype(np.int64)
        return self.marks_ns[self.mark[mine]], np.full(len(satellite), receiver), satellite

    def satellites_of(self, receiver: int, several_signals: bool) -> F64:
        """(e,) different satellites that a receiver measured at each mark."""
        mine = self.receiver == receiver
        mark = self.mark[mine].astype(np.int64)
        if several_signals:
            mark = np.unique(mark * satellites.SATELLITES + self.satellite[mine]) // satellites.SATELLITES
        return np.bincount(mark, minlength=len(self.marks_ns)).astype(float)

    def strength(self, receivers: int) -> dict[int, Strength]:
        """C/N0 by receiver, in at most BUCKETS stretches of time, so that the least and greatest survive."""
        if not len(self.marks_ns):
            return {}
        since_s = (self.marks_ns - self.marks_ns[0]) / NS_PER_S
        bucket = np.floor(since_s / max(since_s[-1] / (BUCKETS - 1), 1e-6)).astype(np.int64)
        return {r: self._strength(self.receiver == r, bucket) for r in range(1, receivers + 1)}

    def _strength(self, mine: Bool, bucket: I64) -> Strength:
        mark, value = self.mark[mine], self.cn0_dbhz[mine].astype(np.float64)
        at, size = bucket[mark], int(bucket[-1]) + 1
        first = np.full(size, len(self.marks_ns))
        np.minimum.at(first, at, mark)
        least, greatest = np.full((2, size), np.nan)
        np.fmin.at(least, at, value)
        np.fmax.at(greatest, at, value)
        measured = ~np.isnan(value)
        count = np.bincount(at[measured], minlength=size)
        total = np.bincount(at[measured], value[measured], size)
        there = np.flatnonzero(first < len(self.marks_ns))
        mean = np.divide(total, count, out=np.full(size, np.nan), where=count > 0)
        return Strength(self.marks_ns[first[there]], least[there], mean[there], greatest[there])


def read_channels(path: Path, craft: str, marks_ns: I64, instants: I64) -> Channels:
    """instants: rows of the time marks at which places of satellites are wanted. The table's times are
    seconds of the marks, and find their nanoseconds again."""
    marks_s = marks_ns / NS_PER_S
    wanted = np.zeros(len(marks_ns) + 1, bool)
    wanted[instants] = True
    looked = evenly(len(marks_ns), _EPOCHS_WITH_RANGES)
    ranged = np.zeros(len(marks_ns) + 1, bool)
    ranged[looked] = True
    none = np.zeros(0, np.int32), np.zeros(0, np.uint8), np.zeros(0, np.int16)
    ranges = [(*none, np.zeros(0, bool), np.zeros(0), np.zeros((0, 3)))]
    rows, seen = [(*none, np.zeros(0, np.float32))], [(*none, np.zeros((0, 6)))]
    for batch in parquet.batches_of_craft(path, craft, (*_NUMBERS, "satellite", "signal")):
        t_s, by, strength, range_m, clock_m, used, *axes = (parquet.numbers(batch, name) for name in _NUMBERS)
        mark = np.searchsorted(marks_s, t_s).astype(np.int32)
        receiver, satellite = by.astype(np.uint8), _satellites(parquet.text(batch, "satellite"))
        rows.append((mark, receiver, satellite, strength.astype(np.float32)))
        at = np.flatnonzero(ranged[mark])
        at = at[_first_signals(parquet.text(batch, "signal"))[at]]
        ranges.append((mark[at], receiver[at], satellite[at], used[at] != 0, range_m[at] + clock_m[at],
                       np.column_stack([axis[at] for axis in axes[:3]])))  # fmt: skip
        at = np.flatnonzero(wanted[mark])
        vectors = np.column_stack([axis[at] for axis in axes])
        seen.append((mark[at], receiver[at], satellite[at], vectors))
    mark, by, satellite, vectors = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    places = Places(marks_ns[mark], satellite.astype(np.int64), vectors[:, :3], vectors[:, 3:])
    whole, by_whom, of_what, used, corrected, place = (np.concatenate(p) for p in zip(*ranges, strict=True))
    kept = Ranges(whole.astype(np.int64), by_whom.astype(np.int64), of_what.astype(np.int64),
                  used.astype(bool), corrected.astype(float), place.astype(float))  # fmt: skip
    mark, receiver, satellite, cn0_dbhz = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    return Channels(marks_ns, mark, receiver, satellite, cn0_dbhz, places, by.astype(np.int64), kept,
                    len(looked))  # fmt: skip


def _first_signals(names: Labelled) -> Bool:
    """(n,) whether a row is of its system's first signal."""
    first = {signal.name for system in SYSTEMS.values() for signal in signals.of_system(system)[:1]}
    return np.array([name in first for name in names.labels], bool)[names.codes]


def _satellites(names: Labelled) -> NDArray[np.int16]:
    """(n,) satellite numbers of a column of names."""
    numbers = {satellites.name(i): i for i in range(satellites.SATELLITES)}
    return np.array([numbers[name] for name in names.labels], np.int16)[names.codes]
