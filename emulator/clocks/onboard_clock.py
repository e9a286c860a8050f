"""The clock of the on-board computer: offset, drift, and a random walk of its time.

The walk is made of steps of one second, each at its own place among the draws. Where an hour of them begins
is remembered, so that every question of a run is answered in passing; the answer depends on the time alone.
Source of the walk: white noise of frequency of Allan deviation s at 1 s lets time walk by s sqrt(t), IEEE Std
1139-2008, annex B
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.numerics.keyed_draws import Stream

_HOUR = 3600


class RandomWalk:
    """A random walk by time since the start, one standard normal step a second, straight within it."""

    def __init__(self, seed: int, craft_key: int):
        self._begins = [0.0]
        self._hour = lru_cache(maxsize=2)(lambda hour: _steps(seed, craft_key, hour))

    def at(self, t_s: float) -> float:
        """Where it is at t_s >= 0."""
        hour, rest_s = divmod(t_s, _HOUR)
        while len(self._begins) <= hour:
            self._begins.append(self._begins[-1] + float(self._hour(len(self._begins) - 1)[-1]))
        second, part = divmod(rest_s, 1.0)
        path = self._hour(int(hour))
        before, after = path[int(second)], path[int(second) + 1]
        return self._begins[int(hour)] + float(before + part * (after - before))


def _steps(seed: int, craft_key: int, hour: int) -> F64:
    """(3601,) walk through an hour from zero, by seconds."""
    raw = Stream(seed, craft_key, "onboard_clock").words(hour, _HOUR)
    return np.concatenate(((0.0,), np.cumsum(keyed_draws.normal(raw))))
