"""What of a sky is not there in a run, told: satellites without orbits, clocks or messages, all or a time.

A run goes on with fewer satellites than its files name, and nobody would know why.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.files.sp3 import Sp3, is_earth_fixed
from gnss_hil.emulator.orbits.tabulated import unexplained

_MINUTE_NS = 60 * gpstime.NS_PER_S

_MOST_MINUTES = 300
"""Of a longer run, so many are tried, evenly."""

_FINE_M = 1.0
"""Doubt of a satellite's place that is not worth a word."""

_STRANGE = 0.02
"""Share of gravity's pull that nothing explains: Moon, Sun and light make 0.001 % at their heights."""

_ARC_S = 300.0

_MOSTLY = 0.9
"""Share of a run from which on a satellite is there: messages have holes of minutes."""


def minutes_ns(begin_ns: int, end_ns: int) -> I64:
    """Middles (s,) of the minutes of a run, all or evenly chosen ones, the first and the last among them."""
    first, last = begin_ns // _MINUTE_NS, end_ns // _MINUTE_NS
    count = min(last - first + 1, _MOST_MINUTES)
    return np.unique(np.linspace(first, last, count).astype(np.int64)) * _MINUTE_NS + _MINUTE_NS // 2


def remarks(index: I64, there: Bool, middles_ns: I64, healthy: Bool | None = None) -> Iterator[str]:
    """What is missing of satellites (n,) that are there (s, n) or not in some minutes (s,), a line each.

    healthy  (s, n) by their messages; None: all
    """
    some = np.asarray(there.any(axis=1))
    if not some.any():
        yield "no satellite is known in the run"
        return
    if not some.all():
        begin, end = map(gpstime.iso, _stretch(~some, middles_ns))
        yield f"no satellite is known in {np.mean(~some):.0%} of the run, from {begin} to {end} GPS at first"
    if healthy is not None and (unfit := some & ~(there & healthy).any(axis=1)).any():
        when = "in the run" if unfit.all() else f"in {np.mean(unfit):.0%} of the run"
        yield f"{when} all satellites known are marked unhealthy by their messages: receivers use none"
    present = there[some].mean(axis=0)
    if (present == 0).any():
        yield f"nothing is known in the run of {satellites.listed(index[present == 0])}"
    partly = (present > 0) & (present < _MOSTLY)
    if partly.any():
        yield f"known in a part of the run only: {satellites.listed(index[partly])}"


def _stretch(missing: Bool, middles_ns: I64) -> tuple[int, int]:
    """Begin of the first minute and end of the last one of the first stretch that is missing (s,)."""
    rows = np.flatnonzero(missing)
    length = int(np.argmax(np.append(np.diff(rows) > 1, True)))
    half_ns = _MINUTE_NS // 2
    return int(middles_ns[rows[0]]) - half_ns, int(middles_ns[rows[length]]) + half_ns


class Orbits(Protocol):
    """Precise orbits, of one interval or of several; see `gnss_hil.emulator.constellation.precise`."""

    @property
    def index(self) -> I64: ...

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Bool]: ...

    def doubt_m(self, middles_ns: I64) -> F64: ...


def of_product(
    product: Sp3, orbits: Orbits, begin_ns: int, end_ns: int, system: int | None = None
) -> Iterator[str]:
    """What is odd about a product for a run, a line each; system: the one it is read for, None for all."""
    if not all(map(is_earth_fixed, product.frame.split(", "))):
        yield f"coordinate system is '{product.frame}'; taken for one of the ITRF"
    if product.apart_m > _FINE_M:
        yield (
            f"files disagree by up to {product.apart_m:.3g} m where several have a place: the last one counts"
        )
    index, column = product.navigation()
    wanted = np.flatnonzero((satellites.system_of(index) == system) | (system is None))
    index, column = index[wanted], column[wanted]
    unknown = ~np.isin(index, orbits.index)
    if unknown.any():
        yield f"no antenna is known of {satellites.listed(index[unknown])}: left out"
    rows = np.flatnonzero((product.t_ns >= begin_ns - _HOUR_NS) & (product.t_ns <= end_ns + _HOUR_NS))
    placed = np.isfinite(product.pos_ecef_m[rows][:, column]).all(axis=2).any(axis=0)
    timed = np.isfinite(product.clock_s[rows][:, column]).any(axis=0)
    silent = index[placed & ~timed & ~unknown]
    if len(silent):
        yield f"no clock in the run's time of {satellites.listed(silent)}: left out"
    zero = (product.clock_s[rows][:, column] == 0) | np.isnan(product.clock_s[rows][:, column])
    still = index[placed & timed & zero.all(axis=0) & ~unknown]
    if len(still):
        yield f"clocks are exactly 0 of {satellites.listed(still)}: are they absent?"
    if product.predicted is not None and product.predicted[rows].any():
        first = int(product.t_ns[rows[np.argmax(product.predicted[rows])]])
        yield f"orbits are predicted, not measured, from {gpstime.iso(first)} on"
    mine = {product.name[k] for k in column.tolist()}
    for t_ns, name, what in product.breaks:
        if name in mine and begin_ns - _HOUR_NS <= t_ns <= end_ns + _HOUR_NS:
            yield f"{name} has {what} before {gpstime.iso(t_ns)}: nothing is interpolated across it"
    yield from _motion(orbits, minutes_ns(begin_ns, end_ns), index)


_HOUR_NS = 3600 * gpstime.NS_PER_S


def _motion(orbits: Orbits, middles_ns: I64, wanted: I64) -> Iterator[str]:
    """Doubts about the places of the wanted satellites (k,) at some instants."""
    mine = np.flatnonzero(np.isin(orbits.index, wanted))
    index, doubt_m = orbits.index[mine], np.nan_to_num(orbits.doubt_m(middles_ns)[:, mine])
    if doubt_m.max(initial=0.0) > _FINE_M:
        worst = satellites.name(int(index[np.argmax(doubt_m.max(axis=0))]))
        yield (
            f"instants are too coarse a step apart: the place of {worst} is uncertain by some "
            f"{doubt_m.max():.3g} m"
        )
    middle_ns = middles_ns[len(middles_ns) // 2 :][:1]
    pos_m, _, there = orbits.sample(middle_ns, np.linspace(-_ARC_S, _ARC_S, 9))
    off = np.array([there[0, k] and unexplained(pos_m[0, :, k], _ARC_S) > _STRANGE for k in mine], bool)
    if off.any():
        yield (
            f"{satellites.listed(index[off])}: motion is not a fall about the Earth: are coordinate system, "
            "units and time system right?"
        )
