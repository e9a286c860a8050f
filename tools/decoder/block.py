"""Accepted frames of some epochs by kind, in columns or grids; a signal is read when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64, U64
from gnss_hil.dbc.common.limits import CHANNELS
from gnss_hil.dbc.contract.codec import Codec, Layout
from gnss_hil.dbc.contract.frames import FrameBatch

Columns = Mapping[str, NDArray]
"""A table: columns (n,) by name."""

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
    """Frames (k,) of one kind, in bus order; `messages["cn0_dbhz"]` is a signal of theirs, (k,), and
    `messages["satellite"]` the index (`gnss_hil.dbc.common.satellites`) of the satellite that they name.

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
        if name == "satellite":
            return satellites.index(self["sat_system"], self["sat_number"])
        return self.layout.signal(name, self.words)


class Block:
    """Consecutive epochs of one bus; `block["RANGE"]` are the frames of a kind.

    codec    of the bus
    epochs   how many there are (e)
    """

    def __init__(self, codec: Codec, can_id: NDArray, words: U64, epoch: I64, epochs: int):
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

    def counts(self, group: NDArray[np.integer], groups: int) -> I64:
        """(e, groups) frames of each epoch whose identifier's group (2048,) is this one."""
        cell = self._epoch * groups + group.take(self._can_id)
        return np.bincount(cell, minlength=self.epochs * groups).reshape(self.epochs, groups)

    def grid(self, kind: str, name: str, fill: float = np.nan) -> NDArray:
        """A signal, (e,), (e, m) or (e, m, CHANNELS) as its kind comes for an epoch, a receiver or a channel.

        `fill` where no frame came, in its type; of several frames the first stands.
        """
        frames = self[kind]
        cell, shape = [frames.epoch], [self.epochs]
        if (kind, 0) not in self.codec.can_id_of:
            cell.append(frames.number - 1)
            shape.append(self.codec.receivers)
        if "channel" in frames.layout.signals:
            cell.append(frames["channel"])
            shape.append(CHANNELS)
        values = np.full(shape, fill)
        values[tuple(rows[::-1] for rows in cell)] = frames[name][::-1]  # the last to be written stands
        return values


def of_frames(codec: Codec, frames: FrameBatch, epoch: I64 | None = None, epochs: int = 1) -> Block:
    """The block of accepted frames (n,), all of one epoch unless `epoch` (n,) is the row of each."""
    row = np.zeros(len(frames), np.int64) if epoch is None else epoch
    return Block(codec, frames.can_id, payloads(frames), row, epochs)


class GrowingTable:
    """A table that comes in pieces with the same columns."""

    def __init__(self):
        self._pieces: list[Columns] = []

    def add(self, columns: Columns) -> None:
        self._pieces.append(columns)

    @property
    def rows(self) -> dict[str, NDArray]:
        """All pieces, one after the other; no columns if none came."""
        if len(self._pieces) > 1:
            names = self._pieces[0]
            self._pieces = [{name: np.concatenate([p[name] for p in self._pieces]) for name in names}]
        return dict(self._pieces[0]) if self._pieces else {}
