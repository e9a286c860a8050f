"""Frames of a block, one epoch after another: what no command changes of the bus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gnss_hil.dbc.common.arrays import I64, U32, U64, Bool
from gnss_hil.dbc.contract.codec import Codec


class Frames(NamedTuple):
    """Frames (f,) in order.

    words, can_id   payloads with blank headers, identifiers
    stream          protected streams;  rank  how many frames of its stream come before it in its epoch
    fits            whether its values fit on the bus: a frame with one that does not is not sent
    """

    words: U64
    can_id: U32
    stream: I64
    rank: I64
    fits: Bool

    def picked(self, rows: slice | I64) -> Frames:
        return Frames(
            self.words[rows], self.can_id[rows], self.stream[rows], self.rank[rows], self.fits[rows]
        )


@dataclass(frozen=True, slots=True, eq=False)
class EpochFrames:
    """Frames of k epochs; starts (k + 1,) first frame of each."""

    every: Frames
    starts: I64

    def __getitem__(self, k: int) -> Frames:
        """An epoch's frames."""
        return self.every.picked(slice(self.starts[k], self.starts[k + 1]))

    @property
    def repeats(self) -> bool:
        """Whether a stream has several frames in an epoch."""
        return bool(self.every.rank.any())


def epoch_frames(codec: Codec, epochs: int, epoch: I64, can_id: U32, words: U64, fits: Bool) -> EpochFrames:
    """Frames (f,) of k epochs; epoch (f,) ascending, 0-based."""
    data = np.ascontiguousarray(words, "<u8").view(np.uint8).reshape(-1, 8)
    stream = codec.key_of(can_id, data)
    starts = np.searchsorted(epoch, np.arange(epochs + 1))
    return EpochFrames(Frames(words, can_id, stream, _ranks(epoch, stream), fits), starts)


def one_after_another(parts: Sequence[EpochFrames]) -> EpochFrames:
    """Frames of the parts as one: in each epoch those of the first part, of the second, and so on. No stream
    is in two parts."""
    of_epoch = [np.repeat(np.arange(len(part.starts) - 1), np.diff(part.starts)) for part in parts]
    order = np.argsort(np.concatenate(of_epoch), kind="stable")
    every = [part.every for part in parts]
    joined = Frames(
        np.concatenate([part.words for part in every]),
        np.concatenate([part.can_id for part in every]),
        np.concatenate([part.stream for part in every]),
        np.concatenate([part.rank for part in every]),
        np.concatenate([part.fits for part in every]),
    )
    return EpochFrames(joined.picked(order), np.sum([part.starts for part in parts], axis=0))


def _ranks(epoch: I64, stream: I64) -> I64:
    """(f,) how many frames of the same stream and epoch come before each."""
    order = np.lexsort((stream, epoch))
    change = np.ones(len(order), bool)
    change[1:] = (np.diff(epoch[order]) != 0) | (np.diff(stream[order]) != 0)
    first = np.flatnonzero(change)
    out = np.empty(len(order), np.int64)
    out[order] = np.arange(len(order)) - np.repeat(first, np.diff(np.append(first, len(order))))
    return out
