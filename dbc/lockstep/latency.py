"""Percentiles of many durations in constant memory."""

from __future__ import annotations

import math

import numpy as np

_LOWEST_S = 1e-6
_RATIO = 1.01
_MERGED = 10
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

    def histogram(self) -> tuple[tuple[float, int], ...]:
        """(upper edge [ms], how many) of bins 10 % wide, from the first to the last that is not empty."""
        padded = np.r_[self._counts, np.zeros(-_BINS % _MERGED, np.int64)].reshape(-1, _MERGED).sum(axis=1)
        filled = np.flatnonzero(padded)
        if not len(filled):
            return ()
        return tuple(
            (float(f"{_LOWEST_S * _RATIO ** (_MERGED * (row + 1)) * 1e3:.5g}"), int(padded[row]))
            for row in range(filled[0], filled[-1] + 1)
        )
