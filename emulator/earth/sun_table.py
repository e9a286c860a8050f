"""The Sun over a run: sampled once, read every epoch."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth.sun_moon import sun_ecef_m
from gnss_hil.emulator.numerics.chebyshev import NS_PER_S, Grid, Table

_GRID = Grid(origin_ns=0, segment_ns=3600 * NS_PER_S, margin_ns=0, degree=8, per_chunk=24)
"""In ECEF the Sun turns by 15 deg an hour: degree 8 follows it to a micrometre a kilometre."""


class Sun:
    """Where the Sun is in ECEF; leap_s: GPS - UTC of the run's start [s]."""

    def __init__(self, leap_s: int):
        self._table = Table(_GRID, lambda chunk: self._sample(chunk, leap_s))

    @staticmethod
    def _sample(chunk: int, leap_s: int) -> F64:
        t_ns = _GRID.middles_ns(chunk)[:, None] + np.rint(_GRID.nodes_s * NS_PER_S).astype(np.int64)
        return sun_ecef_m(t_ns.ravel(), leap_s).reshape(*t_ns.shape, 3)

    def at(self, t_ns: int) -> F64:
        """(3,) geocentric place in ECEF of the instant [m]."""
        return self._table.at(t_ns)[0]

    def over(self, t_ns: I64) -> F64:
        """(q, 3) the same at times (q,)."""
        return self._table.over(t_ns)[:, 0]
