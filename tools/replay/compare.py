"""What came back, held against what was recorded, epoch by epoch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch


@dataclass(slots=True)
class Comparison:
    """exact  in lockstep every frame counts; at other paces heartbeats may come at any time and do not

    epochs     compared
    different  epochs whose frames differ
    first      the first difference, for people; "" if there is none
    """

    codec: Codec
    exact: bool
    epochs: int = 0
    different: int = 0
    first: str = ""

    def add(self, number: int, recorded: FrameBatch, heard: FrameBatch) -> None:
        self.epochs += 1
        recorded, heard = self._relevant(recorded), self._relevant(heard)
        if _same(recorded, heard):
            return
        self.different += 1
        self.first = self.first or f"epoch {number}: {self._difference(recorded, heard)}"

    @property
    def result(self) -> str:
        """What came of it, for people."""
        if not self.different:
            return f"as recorded in all of {so_many(self.epochs, 'epoch')}"
        differs = f"differs from the recording in {self.different} of {so_many(self.epochs, 'epoch')}"
        return f"{differs}, first {self.first}"

    def _relevant(self, frames: FrameBatch) -> FrameBatch:
        if self.exact:
            return frames
        beat = self.codec.kind_of[frames.can_id & SFF_MASK] == self.codec.kinds["HEARTBEAT"].number
        return frames[~beat]

    def _difference(self, recorded: FrameBatch, heard: FrameBatch) -> str:
        n = min(len(recorded), len(heard))
        unequal = np.flatnonzero(
            (recorded.can_id[:n] != heard.can_id[:n]) | (recorded.data[:n] != heard.data[:n]).any(axis=1)
        )
        if not len(unequal):
            return f"{so_many(len(recorded), 'frame')} recorded, {len(heard)} heard"
        row = int(unequal[0])
        return f"{self._frame(recorded, row)} recorded, {self._frame(heard, row)} heard"

    def _frame(self, frames: FrameBatch, row: int) -> str:
        can_id = int(frames.can_id[row])
        kind = int(self.codec.kind_of[can_id & SFF_MASK]) if can_id <= SFF_MASK else -1
        name = self.codec.layouts[kind].name if kind >= 0 else "unknown"
        return f"{name} {can_id:03X}#{frames.data[row, : frames.length[row]].tobytes().hex().upper()}"


def _same(a: FrameBatch, b: FrameBatch) -> bool:
    """Whether the frames are, whenever they were."""
    return (
        len(a) == len(b)
        and bool((a.can_id == b.can_id).all())
        and bool((a.length == b.length).all())
        and bool((a.data == b.data).all())
    )
