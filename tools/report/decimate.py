"""Fewer points for the same picture."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64

BUCKETS = 1000
"""Pieces a trace is cut into: about the width of a plot in pixels."""


def bucket_starts(n: int, buckets: int = BUCKETS) -> I64:
    """(k,) first rows of at most `buckets` pieces of n rows, none of them empty."""
    return np.unique(np.linspace(0, n, min(n, buckets), endpoint=False).astype(np.int64))


def extremes(values: F64, buckets: int = BUCKETS) -> I64:
    """(k,) rows that show every peak and every gap of values (n,), at most three a bucket, in order.

    Of each bucket stay the least, the greatest and the first that is missing (nan). A trace that is short
    enough stays whole.
    """
    n = len(values)
    if n <= 2 * buckets:
        return np.arange(n)
    starts = bucket_starts(n, buckets)
    bucket = np.zeros(n, np.int64)
    bucket[starts[1:]] = 1
    bucket = np.cumsum(bucket)
    least, greatest = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    kinds = values == least[bucket], values == greatest[bucket], np.isnan(values)
    return np.unique(np.r_[0, *(_first_of_each(bucket, np.flatnonzero(kind)) for kind in kinds), n - 1])


def _first_of_each(bucket: I64, rows: I64) -> I64:
    """The first of the rows (k,), ascending, in every bucket that has any."""
    return rows[np.flatnonzero(np.diff(bucket[rows], prepend=-1))]


def evenly(n: int, count: int) -> I64:
    """At most `count` rows of n, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, max(n - 1, 0), min(n, count)).round().astype(np.int64))
