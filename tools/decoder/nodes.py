"""Nodes that fall silent, and nodes that start again.

Silent is a node that was heard before and of which an epoch has no frame that could be used. It has started
again where its heartbeat has another boot count than the one before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.messages import HEARTBEAT_BASE
from gnss_hil.tools.decoder.block import Block, GrowingTable

_NUMBERS = 256
"""More than node numbers there are."""


class Nodes:
    """names   of the nodes that the contract knows"""

    def __init__(self, codec: Codec):
        self.names = tuple(sorted({*codec.sender_of} - {""}))
        self._node_of = np.array([self.names.index(n) if n else 0 for n in codec.sender_of])
        self._heard = np.zeros(len(self.names), bool)
        self._boots = np.full(_NUMBERS, -1)
        self._marks = 0
        self._silent, self._restarted = GrowingTable(), GrowingTable()

    def take(self, block: Block) -> None:
        """The epochs of a block, after those before it."""
        here = block.counts(self._node_of, len(self.names)) > 0
        ever = np.logical_or.accumulate(np.vstack([self._heard, here]), axis=0)
        self._heard = ever[-1]
        row, node = np.nonzero(~here & ever[:-1])
        self._silent.add({"row": self._marks + row, "node": node})
        self._take_boots(block)
        self._marks += block.epochs

    def _take_boots(self, block: Block) -> None:
        beats = block["HEARTBEAT"]
        order = np.argsort(beats.number, kind="stable")
        number, boots = beats.number[order], beats["boot_count"][order]
        first = np.diff(number, prepend=-1) != 0
        before = np.where(first, self._boots[number], np.roll(boots, 1))
        again = (before >= 0) & (boots != before)
        self._boots[number] = boots  # of several of a node the last stands
        node = self._node_of[HEARTBEAT_BASE + number[again]]
        self._restarted.add({"row": self._marks + beats.epoch[order][again], "node": node})

    @property
    def silent(self) -> dict[str, NDArray]:
        """row (of the run's time marks), node (an index of `names`), (k,) each: an epoch of a silent node."""
        return self._silent.rows

    @property
    def restarted(self) -> dict[str, NDArray]:
        """The same of nodes that have started again."""
        return self._restarted.rows
