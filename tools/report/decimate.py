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
    missing = np.isnan(values)
    order = np.lexsort((values, bucket))  # nan sorts behind the greatest
    present = np.add.reduceat((~missing).astype(np.int64), starts)
    least = order[starts]
    greatest = order[starts + np.maximum(present - 1, 0)]
    gaps = np.flatnonzero(missing)
    _, first = np.unique(bucket[gaps], return_index=True)
    return np.unique(np.r_[0, least, greatest, gaps[first], n - 1])


def evenly(n: int, count: int) -> I64:
    """At most `count` rows of n, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, max(n - 1, 0), min(n, count)).round().astype(np.int64))
