"""Which check of the protection saw what, and when: frames by epoch, reason and identifier."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64, U32
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.decoder.block import GrowingTable

BEFORE_FIRST_MARK = "BEFORE_FIRST_MARK"
REASONS = (*(verdict.name for verdict in Verdict), BEFORE_FIRST_MARK)
"""A reason's number is its place here; those of `Verdict` keep theirs. LOST is none to refuse a frame: it is
the frame after a gap in its stream."""

_REASON_BITS, _IDENTIFIER_BITS = 5, 32


class Refusals:
    """Frames that a check saw, counted by epoch, reason and identifier: a babbling node adds a row each."""

    def __init__(self):
        self._counted = GrowingTable()

    def add(self, epoch: I64, reason: NDArray[np.integer] | int, can_id: U32) -> None:
        """Frames (n,): their epochs, -1 before the first; numbers of their reasons; identifiers received."""
        if not len(epoch):
            return
        key = (epoch + 1) << _REASON_BITS | np.asarray(reason, np.int64)
        key = key << _IDENTIFIER_BITS | can_id.astype(np.int64)
        found, frames = np.unique(key, return_counts=True)
        self._counted.add({"key": found, "frames": frames})

    @property
    def rows(self) -> dict[str, NDArray]:
        """epoch, reason, can_id, frames, (k,) each, in this order, whatever the pieces they came in."""
        counted = self._counted.rows
        key, frames = (counted.get(name, np.zeros(0, np.int64)) for name in ("key", "frames"))
        found, place = np.unique(key, return_inverse=True)
        above = found >> _IDENTIFIER_BITS
        return {
            "epoch": (above >> _REASON_BITS) - 1,
            "reason": above & (1 << _REASON_BITS) - 1,
            "can_id": (found & (1 << _IDENTIFIER_BITS) - 1).astype(np.uint32),
            "frames": np.bincount(place, frames, minlength=len(found)).astype(np.int64),
        }
