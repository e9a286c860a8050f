"""Percentiles and bins of durations against the durations themselves."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.lockstep.latency import Latency


def filled(durations_s) -> Latency:
    latency = Latency()
    for duration_s in durations_s:
        latency.add(duration_s)
    return latency


def test_bins_count_what_lies_between_their_edges():
    durations_s = np.random.default_rng(3).lognormal(np.log(4e-3), 0.7, 5000)
    bins = filled(durations_s).histogram()
    edges_ms, counts = np.array([e for e, _ in bins]), np.array([n for _, n in bins])
    assert counts.sum() == 5000
    assert counts[0] > 0 and counts[-1] > 0
    assert np.allclose(edges_ms[1:] / edges_ms[:-1], 1.01**10, rtol=1e-3)
    below = np.searchsorted(np.sort(durations_s * 1e3), edges_ms)
    assert np.abs(np.cumsum(counts) - below).max() <= 3  # edges are written with five digits
    assert len(bins) < 100


def test_no_duration_no_bin_and_the_longest_falls_into_the_last():
    assert filled([]).histogram() == ()
    (bin,) = filled([1e9]).histogram()
    assert bin[1] == 1
    assert len(filled([1e-9, 1e9]).histogram()) == 209


@pytest.mark.verifies(
    "dbc/lockstep/latency.py",
    what="Percentiles of latencies",
    by="NumPy's percentiles, 0.5 %",
    status="validated",
)
def test_percentiles_are_good_to_half_a_percent():
    durations_s = np.random.default_rng(4).uniform(1e-3, 2e-2, 2000)
    latency = filled(durations_s)
    for percent in (1, 50, 99):
        assert latency.percentile_s(percent) == pytest.approx(
            np.percentile(durations_s, percent, method="inverted_cdf"), rel=5.1e-3
        )


def test_the_middle_of_three_is_the_second():
    assert filled([1e-3, 1e-2, 1e-1]).percentile_s(50) == pytest.approx(1e-2, rel=5.1e-3)
