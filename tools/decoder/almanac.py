"""Where satellites are, tracked or not: the almanac frames of one bus."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.tools.decoder.block import Block, GrowingTable
from gnss_hil.tools.decoder.channels import common

_PARTS = {"ALM_XY": ("x_m", "y_m"), "ALM_Z": ("z_m", "health"), "ALM_V": ("vx_mps", "vy_mps", "vz_mps")}
_SPACING_NS = 60 * NS_PER_S
"""One prediction a satellite and minute is kept: carried on with its velocity for a minute it is 1 km off,
0.003 deg as seen from low orbit."""


class AlmanacLog(GrowingTable):
    """Almanac predictions whose three frames came in one epoch from one receiver, thinned out.

    rows  t_ns, sat, x_m .. vz_mps (ECEF), health; by time
    """

    def __init__(self):
        super().__init__()
        self._minute = np.full(satellites.SATELLITES, -1, np.int64)

    def take(self, t_ns: I64, block: Block) -> None:
        """The almanac frames of some epochs, t_ns (e,) the times of their marks."""
        parts = [block[kind] for kind in _PARTS]
        key, rows = common(
            [(part.epoch * 16 + part.number) * satellites.SATELLITES + part["satellite"] for part in parts]
        )
        columns = {"t_ns": t_ns[key // (16 * satellites.SATELLITES)], "sat": key % satellites.SATELLITES}
        for part, row, names in zip(parts, rows, _PARTS.values(), strict=True):
            columns |= {name: part[name][row] for name in names}
        kept = self._first_of_each_minute(columns["t_ns"], columns["sat"])
        if len(kept):
            self.add({name: column[kept] for name, column in columns.items()})

    def _first_of_each_minute(self, t_ns: I64, sat: I64) -> I64:
        """Rows that are the first of their satellite and minute."""
        minute = t_ns // _SPACING_NS
        new = np.flatnonzero((t_ns >= 0) & (minute > self._minute[sat]))
        _, first = np.unique(np.stack([sat[new], minute[new]]), axis=1, return_index=True)
        kept = new[np.sort(first)]
        np.maximum.at(self._minute, sat[kept], minute[kept])
        return kept
