"""Piecewise Chebyshev tables: what costs much to compute is sampled once, and read in microseconds.

Time is cut into segments of equal length, aligned to an origin, and segments are grouped into chunks
that are fitted when first asked for and forgotten when no longer near. A chunk is a pure function of
its number, so values do not depend on the order of questions.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np
from numpy.polynomial import chebyshev

from gnss_hil.dbc.common.arrays import F64, I64

NS_PER_S = 1_000_000_000

Built = TypeVar("Built")


class Chunks(Generic[Built]):
    """The last few results of `build(number)`, so that a long run stays flat in memory."""

    def __init__(self, build: Callable[[int], Built], keep: int = 3):
        self._build = build
        self._keep = keep
        self._held: OrderedDict[int, Built] = OrderedDict()

    def __getitem__(self, number: int) -> Built:
        if number in self._held:
            self._held.move_to_end(number)
            return self._held[number]
        built = self._held[number] = self._build(number)
        if len(self._held) > self._keep:
            self._held.popitem(last=False)
        return built


@lru_cache(maxsize=16)
def lobatto_nodes(degree: int) -> F64:
    """(degree + 1,) Chebyshev-Lobatto nodes on [-1, 1], ascending, both ends included."""
    nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
    nodes.flags.writeable = False
    return nodes


@lru_cache(maxsize=16)
def fit_matrix(degree: int) -> F64:
    """(degree + 1, degree + 1) values at the Lobatto nodes -> Chebyshev coefficients."""
    values = chebyshev.chebvander(lobatto_nodes(degree), degree)
    matrix = np.asarray(np.linalg.solve(values, np.eye(degree + 1)), np.float64)
    matrix.flags.writeable = False
    return matrix


@lru_cache(maxsize=16)
def _derivative_matrix(degree: int) -> F64:
    """(degree + 1, degree + 1) values at the Lobatto nodes -> derivatives by x there."""
    slopes = chebyshev.chebder(fit_matrix(degree))
    matrix = chebyshev.chebvander(lobatto_nodes(degree), degree - 1) @ slopes
    matrix.flags.writeable = False
    return matrix


@lru_cache(maxsize=16)
def _basis_matrix(degree: int, half_s: float) -> F64:
    """(degree + 1, 3, degree + 1) powers of x -> T_k and its first and second derivatives by time,
    x = t / half_s."""
    matrix = np.zeros((degree + 1, 3, degree + 1))
    for k in range(degree + 1):
        power = chebyshev.cheb2poly([0] * k + [1])
        for derivative in range(3):
            column = np.polynomial.polynomial.polyder(power, derivative) / half_s**derivative
            matrix[: len(column), derivative, k] = column
    return matrix


@dataclass(frozen=True, slots=True)
class Grid:
    """How time is cut.

    origin_ns   GPS time of a segment boundary [ns]
    segment_ns  length of a segment [ns]
    margin_ns   how far beyond both ends a segment's polynomial is fitted [ns]
    degree      of the polynomials
    per_chunk   segments fitted together
    """

    origin_ns: int
    segment_ns: int
    margin_ns: int
    degree: int
    per_chunk: int

    @property
    def half_s(self) -> float:
        """Half of the span on which a segment is fitted [s]."""
        return (self.segment_ns / 2 + self.margin_ns) / NS_PER_S

    @property
    def nodes_s(self) -> F64:
        """(degree + 1,) nodes of a segment relative to its middle [s]."""
        return self.half_s * lobatto_nodes(self.degree)

    def segment(self, t_ns):
        """Number of the segment that holds t_ns, a number or (q,): [start, end)."""
        return (t_ns - self.origin_ns) // self.segment_ns

    def middles_ns(self, chunk: int) -> I64:
        """(per_chunk,) GPS times of the middles of a chunk's segments [ns]."""
        first = chunk * self.per_chunk
        return self.origin_ns + (first + np.arange(self.per_chunk)) * self.segment_ns + self.segment_ns // 2

    def fit(self, values: F64) -> F64:
        """Values (s, degree + 1, w) at the nodes of s segments -> coefficients of the same shape."""
        return np.matmul(fit_matrix(self.degree), values)

    def derivative(self, values: F64) -> F64:
        """Time derivative at the nodes of s segments of what has these values (s, degree + 1, w) there."""
        return np.matmul(_derivative_matrix(self.degree), values) / self.half_s

    def evaluate(self, coefficients: F64, segment: int, t_ns: int) -> F64:
        """Value, first and second time derivative, (3, w), of one segment (degree + 1, w) at t_ns."""
        half_s = self.half_s
        middle_ns = self.origin_ns + segment * self.segment_ns + self.segment_ns // 2
        x = (t_ns - middle_ns) / NS_PER_S / half_s
        powers = np.array([x**k for k in range(self.degree + 1)])
        basis = powers @ _basis_matrix(self.degree, half_s).reshape(self.degree + 1, -1)
        return basis.reshape(3, -1) @ coefficients

    def evaluate_many(self, coefficients: Callable[[int], F64], t_ns: I64) -> F64:
        """Values and derivatives (q, 3, w) at times (q,); coefficients of a segment by its number. The same
        numbers as `evaluate`, one product for each segment."""
        segments = self.segment(t_ns)
        out: F64 = np.empty((len(t_ns), 3, 0))
        for segment in np.unique(segments).tolist():
            middle_ns = self.origin_ns + segment * self.segment_ns + self.segment_ns // 2
            here = segments == segment
            x = (t_ns[here] - middle_ns) / NS_PER_S / self.half_s
            powers = x[:, None] ** np.arange(self.degree + 1)
            basis = powers @ _basis_matrix(self.degree, self.half_s).reshape(self.degree + 1, -1)
            values = (basis.reshape(3 * len(x), -1) @ coefficients(segment)).reshape(len(x), 3, -1)
            if len(x) == len(t_ns):
                return values
            if not out.shape[2]:
                out = np.empty((len(t_ns), *values.shape[1:]))
            out[here] = values
        return out


class Table:
    """A vector function of time, read through its piecewise polynomials.

    `sample(chunk)` returns the values (per_chunk, degree + 1, w) at the nodes of the chunk's segments.
    """

    def __init__(self, grid: Grid, sample: Callable[[int], F64]):
        self.grid = grid
        self._chunks = Chunks(lambda chunk: grid.fit(sample(chunk)))

    def at(self, t_ns: int) -> F64:
        """(3, w) value, first and second time derivative at GPS time t_ns."""
        segment = self.grid.segment(t_ns)
        chunk, row = divmod(segment, self.grid.per_chunk)
        return self.grid.evaluate(self._chunks[chunk][row], segment, t_ns)

    def over(self, t_ns: I64) -> F64:
        """(q, 3, w) the same at times (q,)."""

        def coefficients(segment: int) -> F64:
            chunk, row = divmod(segment, self.grid.per_chunk)
            return self._chunks[chunk][row]

        return self.grid.evaluate_many(coefficients, t_ns)
