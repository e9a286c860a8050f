"""Precise orbits and clocks, between the epochs of a product.

Positions are interpolated by a polynomial through POINTS instants, in axes that do not turn with the Earth
while they are; clocks by a line between two. Nothing is interpolated across a gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.counts import so_many
from gnss_hil.emulator.constellation.phase_centre import antenna_m
from gnss_hil.emulator.earth.constants import LIGHT_MPS, ROTATION_RPS, eci_to_ecef
from gnss_hil.emulator.earth.sun_moon import sun_ecef_m
from gnss_hil.emulator.files.sp3 import Sp3

POINTS = 10
"""Instants of a polynomial, five on either side: at 15 min GPS and GLONASS come out to a millimetre inside a
product and to centimetres in its last interval; more instants serve the inside, and harm the ends."""


@lru_cache(maxsize=4)
def _chebyshev_of(points: int) -> F64:
    """(points, points) values at instants evenly over [-1, 1] -> Chebyshev coefficients of the polynomial."""
    values = chebyshev.chebvander(np.linspace(-1, 1, points), points - 1)
    return np.asarray(np.linalg.inv(values), np.float64)


def weights(x: F64, points: int) -> tuple[F64, F64]:
    """Lagrange's polynomials and their derivatives, both (..., points), at x (...,).

    The instants lie evenly over [-1, 1]; a value is the sum of weights by the values at the instants.
    """
    coefficients = _chebyshev_of(points)
    slopes = chebyshev.chebder(coefficients)
    return chebyshev.chebvander(x, points - 1) @ coefficients, chebyshev.chebvander(x, points - 2) @ slopes


def arcs(there: Bool) -> tuple[I64, I64]:
    """First and last row (t, n) of the unbroken arc that each present element of `there` (t, n) is in;
    first > last where it is not in one."""
    rows = np.arange(len(there))[:, None]
    first = np.maximum.accumulate(np.where(there, -1, rows)) + 1
    last = np.minimum.accumulate(np.where(there, len(there), rows)[::-1])[::-1] - 1
    return first, last


@dataclass(frozen=True, slots=True, eq=False)
class PreciseOrbits:
    """Satellites on a regular grid of instants.

    index       (n,) satellite index, ascending
    start_ns, step_ns   first instant of the grid, GPS time, and its step [ns]
    pos_ecef_m  (t, n, 3) centres of mass [m], nan where there is none
    clock_s     (t, n) against GPS time, without periodic relativity [s], nan where there is none
    offset_m    (n, 3) antenna phase centre in the satellite's axes [m], see `phase_centre`; zeros leave the
                centre of mass
    """

    index: I64
    start_ns: int
    step_ns: int
    pos_ecef_m: F64
    clock_s: F64
    offset_m: F64

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last instant of the grid, GPS time [ns]."""
        return self.start_ns, self.start_ns + (len(self.pos_ecef_m) - 1) * self.step_ns

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Bool]:
        """Positions, clocks and availability in segments of time.

        middles_ns  (s,) middles of segments, GPS time [ns];  nodes_s (k,) relative to them [s]
        returns     (s, k, n, 3) antenna phase centres [m], ECEF axes of each node's instant;
                    (s, k, n) clocks [m], to be added to an ionosphere-free pseudorange: c times the clock
                    plus its periodic relativity, -2 r.v / c^2;
                    (s, n) whether the product has both around a middle, or as far as half a segment beyond
                    the last instant. Where they are not, numbers are finite and without meaning.
        Source of the relativity: IS-GPS-200, 20.3.3.3.3.1
        """
        before, held, first, last = self._held(middles_ns)
        pos_m, vel_mps = self._interpolated(middles_ns, nodes_s, before, held, first, last, POINTS)
        clock_s = self._clocks(middles_ns, nodes_s, before)
        (first_ns, last_ns), half_ns = self.span_ns, round(nodes_s[-1] * gpstime.NS_PER_S)
        inside = (middles_ns + half_ns >= first_ns) & (middles_ns - half_ns <= last_ns)
        available = held & np.isfinite(clock_s).all(axis=1) & inside[:, None]
        relativity_s = -2 / LIGHT_MPS**2 * np.einsum("sknj,sknj->skn", pos_m, vel_mps)
        clocks_m = LIGHT_MPS * (np.nan_to_num(clock_s) + relativity_s)
        if self.offset_m.any():
            pos_m = antenna_m(pos_m, _suns_m(middles_ns, nodes_s)[:, :, None], self.offset_m)
        turn_rad = (ROTATION_RPS * nodes_s)[:, None]
        return eci_to_ecef(pos_m, turn_rad), clocks_m, available

    def doubt_m(self, middles_ns: I64) -> F64:
        """(s, n) about how far positions at GPS times (s,) may be off at most, by what two instants less make
        of them [m]; nan where there are none."""
        before, held, first, last = self._held(middles_ns)
        whole, fewer = (
            self._interpolated(middles_ns, np.zeros(1), before, held, first, last, points)[0][:, 0]
            for points in (POINTS, POINTS - 2)
        )
        return np.where(held, np.linalg.norm(whole - fewer, axis=2), np.nan)

    def _held(self, middles_ns: I64) -> tuple[I64, Bool, I64, I64]:
        """Row (s,) of the instant before, whether a satellite's arc around it is long enough (s, n), and the
        arc's first and last row (s, n)."""
        before = np.clip((middles_ns - self.start_ns) // self.step_ns, 0, len(self.pos_ecef_m) - 2)
        first, last = arcs(np.asarray(np.isfinite(self.pos_ecef_m).all(axis=2)))
        first, last = first[before], last[before + 1]
        held = (first <= before[:, None]) & (last > before[:, None]) & (last - first >= POINTS - 1)
        return before, held, first, last

    def _interpolated(self, middles_ns, nodes_s, before, held, first, last, points: int) -> tuple[F64, F64]:
        """Positions and velocities (s, k, n, 3) in the axes that ECEF has in the middle of each segment."""
        window = np.clip(before[:, None] - (points // 2 - 1), first, np.maximum(last - points + 1, first))
        window = np.where(held, window, 0)
        rows = window[..., None] + np.arange(points)
        given_m = self.pos_ecef_m[
            np.minimum(rows, len(self.pos_ecef_m) - 1), np.arange(len(self.index))[:, None]
        ]
        given_m = np.where(held[..., None, None], given_m, _ANYWHERE_M)
        given_s = (self.start_ns + rows * self.step_ns - middles_ns[:, None, None]) / gpstime.NS_PER_S
        still_m = eci_to_ecef(given_m, -ROTATION_RPS * given_s)
        half_s = (points - 1) * self.step_ns / gpstime.NS_PER_S / 2
        x = (nodes_s[:, None] - given_s[:, None, :, 0]) / half_s - 1
        value, slope = weights(np.where(held[:, None], x, 0.0), points)
        return (
            np.einsum("sknp,snpj->sknj", value, still_m),
            np.einsum("sknp,snpj->sknj", slope / half_s, still_m),
        )

    def _clocks(self, middles_ns, nodes_s, before) -> F64:
        """Clocks (s, k, n) [s] on the lines between two instants, nan where one is missing.

        A line, because what moves an atomic clock is above all white frequency noise: between two readings
        the best guess of such a walk is the straight way.
        """
        since_s = (middles_ns - self.start_ns - before * self.step_ns) / gpstime.NS_PER_S
        share = (since_s[:, None] + nodes_s) * gpstime.NS_PER_S / self.step_ns
        left, right = self.clock_s[before][:, None], self.clock_s[before + 1][:, None]
        return left + share[..., None] * (right - left)


_ANYWHERE_M = np.array((2.6e7, 0.0, 0.0))
"""Where satellites are put that are nowhere: numbers stay finite."""


def _suns_m(middles_ns: I64, nodes_s: F64) -> F64:
    """The Sun (s, k, 3) at the nodes, in the axes that ECEF has in the middle of each segment [m].

    In a minute the Sun moves by 12 urad among the stars: one place does for a segment.
    """
    leap_s = gpstime.leap_seconds(int(middles_ns[0]))
    return np.broadcast_to(sun_ecef_m(middles_ns, leap_s)[:, None], (len(middles_ns), len(nodes_s), 3))


def from_sp3(product: Sp3, offset_m: F64 | None = None) -> PreciseOrbits:
    """The navigation satellites of a product (`sp3.joined` makes one of several).

    offset_m  (SATELLITES, 3) by satellite index, nan of satellites to be left out (`phase_centre.offsets_m`);
              None leaves centres of mass
    ValueError, one line, if the product's instants are on no regular grid or too few.
    """
    index, column = product.navigation()
    if offset_m is not None:
        known = np.isfinite(offset_m[index]).all(axis=1)
        index, column = index[known], column[known]
    steps_ns = np.diff(product.t_ns)
    step_ns = int(steps_ns.min()) if len(steps_ns) else 0
    if len(product.t_ns) < POINTS or (steps_ns % step_ns).any() or not len(index):
        raise ValueError(
            f"{product.origin}: {so_many(len(product.t_ns), 'instant')} of "
            f"{so_many(len(index), 'satellite')}; needed are {POINTS} on a regular grid, of one at least"
        )
    row = (product.t_ns - product.t_ns[0]) // step_ns
    pos, clock = np.full((row[-1] + 1, len(index), 3), np.nan), np.full((row[-1] + 1, len(index)), np.nan)
    pos[row], clock[row] = product.pos_ecef_m[:, column], product.clock_s[:, column]
    offset = np.zeros((len(index), 3)) if offset_m is None else offset_m[index]
    return PreciseOrbits(index, int(product.t_ns[0]), step_ns, pos, clock, offset)


@dataclass(frozen=True, slots=True, eq=False)
class LayeredOrbits:
    """Satellites of products of several intervals: where the finest has one, it counts.

    index   (n,) satellite index, ascending
    layers  each on a grid of its own, by step; instants of a finer one are in the coarser ones too, as far as
            they are on their grids
    """

    index: I64
    layers: tuple[PreciseOrbits, ...]

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last instant of any grid, GPS time [ns]."""
        first, last = zip(*(layer.span_ns for layer in self.layers), strict=True)
        return min(first), max(last)

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Bool]:
        """See `PreciseOrbits.sample`."""
        shape = len(middles_ns), len(nodes_s), len(self.index)
        pos_m = np.broadcast_to(_ANYWHERE_M, (*shape, 3)).copy()
        clocks_m, available = np.zeros(shape), np.zeros((shape[0], shape[2]), bool)
        for layer in self.layers:
            column = np.searchsorted(self.index, layer.index)
            pos, clock, there = layer.sample(middles_ns, nodes_s)
            fresh = there & ~available[:, column]
            pos_m[:, :, column] = np.where(fresh[:, None, :, None], pos, pos_m[:, :, column])
            clocks_m[:, :, column] = np.where(fresh[:, None], clock, clocks_m[:, :, column])
            available[:, column] |= there
        return pos_m, clocks_m, available

    def doubt_m(self, middles_ns: I64) -> F64:
        """See `PreciseOrbits.doubt_m`."""
        doubt_m = np.full((len(middles_ns), len(self.index)), np.nan)
        for layer in self.layers:
            column = np.searchsorted(self.index, layer.index)
            doubt_m[:, column] = np.where(
                np.isnan(doubt_m[:, column]), layer.doubt_m(middles_ns), doubt_m[:, column]
            )
        return doubt_m


def steps_ns(product: Sp3) -> list[int]:
    """Intervals, ascending, at which satellites have positions often enough for a polynomial [ns].

    Agencies differ in the interval, and so do the systems of one agency: a joined product has several.
    """
    there = np.asarray(np.isfinite(product.pos_ecef_m).all(axis=2))
    found: set[int] = set()
    for column in there.T:
        steps, counts = np.unique(np.diff(product.t_ns[column]), return_counts=True)
        found |= set(steps[counts >= POINTS - 1].tolist())
    return sorted(found)


def layered(product: Sp3, offset_m: F64 | None = None) -> PreciseOrbits | LayeredOrbits:
    """The navigation satellites of a product whose satellites may have several intervals; see `from_sp3`."""
    steps = steps_ns(product)
    if len(steps) < 2:
        return from_sp3(product, offset_m)
    layers = tuple(from_sp3(_on_grid(product, step_ns), offset_m) for step_ns in steps)
    return LayeredOrbits(np.unique(np.concatenate([layer.index for layer in layers])), layers)


def _on_grid(product: Sp3, step_ns: int) -> Sp3:
    """The instants of a product that are whole steps from those that most often are a step apart."""
    regular = np.flatnonzero(np.isin(product.t_ns + step_ns, product.t_ns))
    phases, counts = np.unique(product.t_ns[regular] % step_ns, return_counts=True)
    rows = np.flatnonzero(product.t_ns % step_ns == phases[np.argmax(counts)])
    return replace(
        product, t_ns=product.t_ns[rows], pos_ecef_m=product.pos_ecef_m[rows], clock_s=product.clock_s[rows]
    )
