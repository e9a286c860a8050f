"""Nodes that fall silent: heard in an epoch before, and of which an epoch has no frame that could be used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.tools.decoder.block import Block, GrowingTable


class Silences:
    """nodes  names of those that the contract knows"""

    def __init__(self, codec: Codec):
        self.nodes = tuple(sorted({*codec.sender_of} - {""}))
        self._node_of = np.array([self.nodes.index(n) if n else 0 for n in codec.sender_of])
        self._heard = np.zeros(len(self.nodes), bool)
        self._found = GrowingTable()

    def take(self, t_ns: I64, block: Block) -> None:
        """The epochs of a block, whose marks are at t_ns (e,), after those before it."""
        here = block.counts(self._node_of, len(self.nodes)) > 0
        ever = np.logical_or.accumulate(np.vstack([self._heard, here]), axis=0)
        self._heard = ever[-1]
        epoch, node = np.nonzero(~here & ever[:-1])
        if len(epoch):
            self._found.add({"t_ns": t_ns[epoch], "node": node})

    @property
    def rows(self) -> dict[str, NDArray]:
        """t_ns, node (an index of `nodes`), (k,) each: one row for each epoch that a node is silent."""
        return self._found.rows or {"t_ns": np.zeros(0, np.int64), "node": np.zeros(0, np.int64)}
