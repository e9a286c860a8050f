"""Percentiles of many durations in constant memory."""

from __future__ import annotations

import math

import numpy as np

_LOWEST_S = 1e-6
_RATIO = 1.01
_BINS = math.ceil(math.log(1e9) / math.log(_RATIO))


class Latency:
    """A histogram with bins 1 % wide from 1 us to 1000 s: percentiles are good to 0.5 %."""

    def __init__(self):
        self._counts = np.zeros(_BINS, np.int64)

    def add(self, duration_s: float) -> None:
        row = int(math.log(max(duration_s, _LOWEST_S) / _LOWEST_S) / math.log(_RATIO))
        self._counts[min(row, _BINS - 1)] += 1

    def percentile_s(self, percent: float) -> float | None:
        """The duration that `percent` of all are not longer than; None if there was none."""
        total = int(self._counts.sum())
        if not total:
            return None
        row = int(np.searchsorted(np.cumsum(self._counts), max(1, math.ceil(total * percent / 100))))
        return _LOWEST_S * _RATIO ** (row + 0.5)
