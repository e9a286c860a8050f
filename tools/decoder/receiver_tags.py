"""What each receiver's own clock showed at the time marks, and which oscillator it runs on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.tools.decoder.block import Block


class TagLog:
    """The TAG frames of one bus."""

    def __init__(self):
        self._pieces: list[dict[str, NDArray]] = []

    def take(self, t_ns: I64, block: Block) -> None:
        """The tags of some epochs, t_ns (e,) the times of their marks, -1 where unknown."""
        tag = block["TAG"]
        known = t_ns[tag.epoch] >= 0
        columns = {"t_ns": t_ns[tag.epoch], "receiver": tag.number}
        columns |= {name: tag[name].astype(np.int64) for name in ("tag_offset_ns", "clock_domain")}
        self._pieces.append({name: values[known] for name, values in columns.items()})

    @property
    def rows(self) -> dict[str, I64]:
        """One row per tag: t_ns, receiver (1-based), tag_offset_ns, clock_domain."""
        names = ("t_ns", "receiver", "tag_offset_ns", "clock_domain")
        return {n: np.concatenate([np.zeros(0, np.int64), *(p[n] for p in self._pieces)]) for n in names}
