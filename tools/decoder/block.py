"""Accepted frames of some epochs by message kind; a signal is read when it is asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64, U64
from gnss_hil.dbc.contract.codec import Codec, Layout
from gnss_hil.dbc.contract.frames import FrameBatch

EPOCHS = 16
"""A frame names its epoch modulo this."""


def payloads(frames: FrameBatch) -> U64:
    """(n,) payloads as little-endian words."""
    return np.ascontiguousarray(frames.data).view("<u8")[:, 0]


def epoch_nibbles(words: U64) -> I64:
    """(n,) epoch modulo 16 in the protection header."""
    return ((words >> 12) & 15).astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Messages:
    """Frames (k,) of one kind, in bus order; `messages["cn0_dbhz"]` is a signal of theirs, (k,).

    epoch    row of the block's epochs
    number   of the receiver or node, 1-based; 0 where the kind does not repeat
    """

    layout: Layout
    epoch: I64
    number: I64
    words: U64

    def __len__(self) -> int:
        return len(self.words)

    def __getitem__(self, name: str) -> NDArray:
        return self.layout.signal(name, self.words)

    @property
    def satellite(self) -> I64:
        """(k,) satellite index (`dbc.common.satellites`)."""
        return satellites.index(self["sat_system"], self["sat_number"])


class Block:
    """Consecutive epochs of one bus; `block["RANGE"]` are the frames of a kind.

    codec    of the bus
    epochs   how many there are
    """

    def __init__(self, codec: Codec, can_id: NDArray, words: U64, epoch: NDArray, epochs: int):
        """can_id, words, epoch (n,): identifiers of the contract, payloads, rows of epochs, in bus order."""
        kind = codec.kind_of.take(can_id).astype(np.uint8)
        order = np.argsort(kind, kind="stable")  # one byte: radix sort
        self._bounds = np.searchsorted(kind[order], np.arange(len(codec.layouts) + 1)).tolist()
        self._can_id, self._words, self._epoch = can_id[order], words[order], epoch[order]
        self.codec, self.epochs = codec, epochs

    def __len__(self) -> int:
        return len(self._words)

    def __getitem__(self, kind: str) -> Messages:
        layout = self.codec.kinds[kind]
        mine = slice(self._bounds[layout.number], self._bounds[layout.number + 1])
        number = self.codec.number_of.take(self._can_id[mine]).astype(np.int64)
        return Messages(layout, self._epoch[mine], number, self._words[mine])


def of_frames(codec: Codec, frames: FrameBatch, epoch: I64 | None = None, epochs: int = 1):
    """The block of accepted frames (n,), all of one epoch unless `epoch` (n,) tells the row of each."""
    row = np.zeros(len(frames), np.int64) if epoch is None else epoch
    return Block(codec, frames.can_id, payloads(frames), row, epochs)
