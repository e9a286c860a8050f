"""The recorder: every frame of a run into bus.log, as it happens.

A frame's stamp is the simulated instant its first bit is on the bus: UNIX time of the epoch's mark plus the
exact length, stuff bits included, of the frames before it in the epoch (`gnss_hil.dbc.contract.bits`). The
mark's time is that of its own frames, with any emulator; where they are not intact, it is reckoned.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.decoder.time_marks import epoch_times_ns, reckoned_ns
from gnss_hil.tools.recording.formats.candump import format_lines

BATCH_FRAMES = 16_384
FLUSH_S = 0.5
_US_PER_BIT = 1_000_000 // BIT_RATE


def stamps_us(mark_unix_us: np.ndarray, counts: np.ndarray, bits: np.ndarray) -> np.ndarray:
    """(n,) UNIX times [us] of frames whose epochs begin at mark_unix_us (e,) and hold counts (e,) frames."""
    before = np.cumsum(bits) - bits
    starts = np.cumsum(counts) - counts
    offset = before - np.repeat(before[np.minimum(starts, len(bits) - 1)], counts)
    return np.repeat(mark_unix_us, counts) + offset * _US_PER_BIT


@dataclass(slots=True)
class _Waiting:
    """Epochs of one bus that are not written yet, in order; number and time [ns] of one that was written."""

    codec: Codec
    anchor: tuple[int, int]
    epochs: list[int] = field(default_factory=list)
    blocks: list[FrameBatch] = field(default_factory=list)
    frames: int = 0

    def take(self, before: float) -> tuple[list[int], list[FrameBatch]]:
        """The epochs before one, taken out."""
        n = bisect_left(self.epochs, before)
        taken = self.epochs[:n], self.blocks[:n]
        self.epochs, self.blocks = self.epochs[n:], self.blocks[n:]
        self.frames -= sum(map(len, taken[1]))
        return taken


@dataclass(frozen=True, slots=True, eq=False)
class _Batch:
    """Epochs (e,) of a bus in order, how many frames each has (e,), their frames (n,) and bits (n,)."""

    bus: int
    epochs: NDArray[np.int64]
    counts: NDArray[np.int64]
    frames: FrameBatch
    bits: NDArray[np.int64]


class Recorder:
    """Collects epochs of all buses and writes them in batches, at the latest after FLUSH_S of wall time.

    buses     codec by name in the log, one for each craft
    start_ns, interval_ns  times of epochs whose own time frames are missing
    log       where the text goes, None to write none
    on_batch  is handed every batch as it is written: number of the bus, frames, their bits on the wire

    With several buses an epoch is written when all have it, one bus after the other.
    """

    def __init__(
        self,
        buses: Mapping[str, Codec],
        start_ns: int,
        interval_ns: int,
        log: BinaryIO | None,
        on_batch: Callable[[int, FrameBatch, NDArray[np.int64]], None] | None = None,
    ):
        self._buses = tuple(buses)
        self._interval_ns = interval_ns
        self._log = log
        self._on_batch = on_batch
        self._waiting = [_Waiting(codec, (0, start_ns)) for codec in buses.values()]
        self._written_at = time.monotonic()
        self.frames = 0
        frame_bits(EMPTY)  # builds its tables now, not while the run is timed

    def add(self, bus: int, epoch: int, frames: FrameBatch) -> None:
        """The frames of an epoch on one bus in canonical order."""
        waiting = self._waiting[bus]
        waiting.epochs.append(epoch)
        waiting.blocks.append(frames)
        waiting.frames += len(frames)
        self.frames += len(frames)
        if waiting.frames >= BATCH_FRAMES or time.monotonic() - self._written_at > FLUSH_S:
            self._write(min(w.epochs[-1] if w.epochs else -1 for w in self._waiting) + 1)

    def flush(self) -> None:
        """Write all that is waiting."""
        self._write(float("inf"))

    def _write(self, before: float) -> None:
        self._written_at = time.monotonic()
        batches = []
        for bus, waiting in enumerate(self._waiting):
            epochs, blocks = waiting.take(before)
            if epochs:
                frames = concat(blocks)
                counts = np.array([len(block) for block in blocks])
                batches.append(_Batch(bus, np.array(epochs, np.int64), counts, frames, frame_bits(frames)))
        if self._log is not None:
            self._log.write(self._text(batches))
            self._log.flush()
        if self._on_batch is not None:
            for batch in batches:
                self._on_batch(batch.bus, batch.frames, batch.bits)

    def _text(self, batches: list[_Batch]) -> bytes:
        """Log text of some epochs; of several buses epoch by epoch."""
        texts = [self._lines(batch) for batch in batches]
        if len(texts) == 1:
            return texts[0]
        pieces = []
        for batch, text in zip(batches, texts, strict=True):
            ends = np.cumsum(batch.counts)
            lines = text.splitlines(keepends=True)
            for epoch, begin, end in zip(batch.epochs, ends - batch.counts, ends, strict=True):
                pieces.append((epoch, batch.bus, b"".join(lines[begin:end])))
        return b"".join(text for _, _, text in sorted(pieces, key=lambda piece: piece[:2]))

    def _lines(self, batch: _Batch) -> bytes:
        """Log text of epochs of one bus, which must come in order."""
        waiting = self._waiting[batch.bus]
        reported = epoch_times_ns(waiting.codec, batch.frames, batch.counts, batch.epochs)
        t_ns = reckoned_ns(reported, batch.epochs, self._interval_ns, waiting.anchor)
        waiting.anchor = int(batch.epochs[-1]), int(t_ns[-1])
        unix_us = np.array([gpstime.to_unix_ns(t) // 1000 for t in t_ns.tolist()])
        stamps = stamps_us(unix_us, batch.counts, batch.bits)
        return format_lines(stamps, batch.frames, self._buses[batch.bus])
