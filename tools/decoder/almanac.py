"""Where satellites are, tracked or not: the almanac frames of one bus."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.tools.decoder.block import Block

_PARTS = {"ALM_XY": ("x_m", "y_m"), "ALM_Z": ("z_m", "health"), "ALM_V": ("vx_mps", "vy_mps", "vz_mps")}
_SPACING_NS = 60 * NS_PER_S
"""One prediction a satellite and minute is kept: carried on with its velocity for a minute it is 1 km off,
0.003 deg as seen from low orbit."""


class AlmanacLog:
    """Almanac predictions whose three frames came in one epoch from one receiver, thinned out."""

    def __init__(self):
        self._kept: list[dict[str, NDArray]] = []
        self._minute = np.full(satellites.SATELLITES, -1, np.int64)

    def take(self, t_ns: I64, block: Block) -> None:
        """The almanac frames of some epochs, t_ns (e,) the times of their marks."""
        keys, parts = [], []
        for kind, names in _PARTS.items():
            said = block[kind]
            of_part = (said.epoch * 16 + said.number) * satellites.SATELLITES + said.satellite
            unique, first = np.unique(of_part, return_index=True)
            keys.append(unique)
            parts.append((unique, first, {name: said[name] for name in names}))
        key = reduce(np.intersect1d, keys)
        if not len(key):
            return
        rows = {"t_ns": t_ns[key // (16 * satellites.SATELLITES)], "sat": key % satellites.SATELLITES}
        for unique, first, columns in parts:
            at = first[np.searchsorted(unique, key)]
            rows |= {name: column[at] for name, column in columns.items()}
        self._keep(rows)

    def _keep(self, rows: dict[str, NDArray]) -> None:
        """The first of each satellite and minute."""
        minute = rows["t_ns"] // _SPACING_NS
        new = np.flatnonzero((rows["t_ns"] >= 0) & (minute > self._minute[rows["sat"]]))
        _, first = np.unique(np.stack([rows["sat"][new], minute[new]]), axis=1, return_index=True)
        kept = new[np.sort(first)]
        if len(kept):
            np.maximum.at(self._minute, rows["sat"][kept], minute[kept])
            self._kept.append({name: column[kept] for name, column in rows.items()})

    @property
    def rows(self) -> dict[str, NDArray]:
        """t_ns, sat, x_m .. vz_mps (ECEF), health; by time. Empty if no almanac came."""
        if not self._kept:
            return {}
        return {name: np.concatenate([k[name] for k in self._kept]) for name in self._kept[0]}
