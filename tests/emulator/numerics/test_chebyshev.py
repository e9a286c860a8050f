"""Piecewise tables: exact for polynomials, right derivatives, the same values in any order of questions."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.numerics.chebyshev import NS_PER_S, Chunks, Grid, Table

GRID = Grid(origin_ns=5 * NS_PER_S, segment_ns=60 * NS_PER_S, margin_ns=2 * NS_PER_S, degree=8, per_chunk=4)
RATE = 1.2e-3


def circle(t_s):
    return np.stack((7e6 * np.cos(RATE * t_s), 7e6 * np.sin(RATE * t_s)), axis=-1)


def table(counter=None):
    def sample(chunk):
        if counter is not None:
            counter.append(chunk)
        t_s = (GRID.middles_ns(chunk) - GRID.origin_ns)[:, None] / NS_PER_S + GRID.nodes_s
        return circle(t_s)

    return Table(GRID, sample)


@pytest.mark.parametrize("t_s", [0.0, 0.001, 29.3, 59.999, 60.0, 245.7, 1e4, -0.5, -1234.5])
def test_value_and_derivatives_of_a_low_orbit(t_s):
    value, rate, acceleration = table().at(GRID.origin_ns + round(t_s * NS_PER_S))
    assert value == pytest.approx(circle(t_s), abs=1e-5)
    assert rate == pytest.approx(RATE * np.array((-1, 1)) * circle(t_s)[::-1], abs=1e-6)
    assert acceleration == pytest.approx(-(RATE**2) * circle(t_s), abs=1e-6)


def test_a_segment_holds_its_start_and_not_its_end():
    assert [GRID.segment(GRID.origin_ns + t) for t in (-1, 0, 60 * NS_PER_S - 1, 60 * NS_PER_S)] == [
        -1,
        0,
        0,
        1,
    ]


def test_beyond_a_segments_ends_its_polynomial_still_holds():
    """What was transmitted just before a segment began belongs to its ephemeris."""
    values = circle((GRID.middles_ns(0) - GRID.origin_ns)[:, None] / NS_PER_S + GRID.nodes_s)
    coefficients = GRID.fit(values)[1]
    for t_s in (58.5, 121.5):
        value = GRID.evaluate(coefficients, 1, GRID.origin_ns + round(t_s * NS_PER_S))[0]
        assert value == pytest.approx(circle(t_s), abs=1e-5)


def test_values_do_not_depend_on_the_order_of_questions():
    times = [GRID.origin_ns + k * 37 * NS_PER_S for k in range(60)]
    forward, backward = table(), table()
    ahead = {t: forward.at(t).tobytes() for t in times}
    assert ahead == {t: backward.at(t).tobytes() for t in reversed(times)}


def test_memory_stays_flat_and_a_chunk_is_built_once_in_passing():
    asked = []
    long = table(asked)
    for k in range(2000):
        long.at(GRID.origin_ns + k * 10 * NS_PER_S)
    assert asked == sorted(set(asked))
    assert len(long._chunks._held) == 3


def test_chunks_forget_the_one_longest_unused():
    built = []
    chunks = Chunks(lambda number: built.append(number) or number, keep=2)
    assert [chunks[n] for n in (1, 2, 1, 3, 1, 2)] == [1, 2, 1, 3, 1, 2]
    assert built == [1, 2, 3, 2]
