"""Thinning keeps what a person looks for: peaks, gaps, the ends."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.tools.report.decimate import bucket_starts, evenly, extremes

pytestmark = pytest.mark.verifies(
    "tools/report/decimate.py",
    what="Report: thinning keeps peaks",
    by="property of every bucket",
    status="validated",
)


def test_a_short_trace_stays_whole():
    assert extremes(np.arange(20.0), buckets=10).tolist() == list(range(20))


def test_single_spikes_in_a_day_survive():
    values = np.random.default_rng(1).normal(size=86_400)
    values[12_345], values[70_001] = 500, -500
    rows = extremes(values)
    assert {0, 12_345, 70_001, 86_399} <= set(rows.tolist())
    assert len(rows) <= 2002


def test_a_gap_of_one_epoch_survives():
    values = np.ones(50_000)
    values[31_415] = np.nan
    rows = extremes(values, buckets=100)
    assert 31_415 in rows
    assert (np.diff(rows) > 0).all()


def test_a_trace_of_gaps_is_thinned_too():
    assert len(extremes(np.full(10_000, np.nan), buckets=50)) <= 3 * 50 + 2


@pytest.mark.slow
@given(
    st.lists(st.one_of(st.floats(-1e6, 1e6), st.just(float("nan"))), min_size=41, max_size=300),
    st.integers(1, 20),
)
def test_every_bucket_keeps_its_least_and_its_greatest(values, buckets):
    values = np.array(values)
    rows = extremes(values, buckets)
    bounds = np.r_[bucket_starts(len(values), buckets), len(values)]
    for a, b in pairwise(bounds):
        whole, kept = values[a:b], values[rows[(rows >= a) & (rows < b)]]
        assert np.isnan(kept).any() == np.isnan(whole).any()
        if not np.isnan(whole).all():
            assert (np.nanmin(kept), np.nanmax(kept)) == (np.nanmin(whole), np.nanmax(whole))


@pytest.mark.parametrize(("n", "count"), [(0, 5), (1, 5), (5, 5), (1000, 7)])
def test_even_rows_hold_both_ends(n, count):
    rows = evenly(n, count)
    assert len(rows) == min(n, count)
    assert n == 0 or (rows[0], rows[-1]) == (0, n - 1)
