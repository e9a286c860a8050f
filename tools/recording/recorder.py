"""The recorder: every frame of a run into bus.log, as it happens.

A frame's stamp is the simulated instant its first bit is on the bus: UNIX time of the epoch's mark plus the
exact length, stuff bits included, of the frames before it in the epoch (`dbc.contract.bits`). The mark's
time is what
the epoch says of itself on the bus, whoever the emulator is; where it says nothing intact, it is reckoned.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.decoder.mark_time import marks_ns, said_ns
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


class Recorder:
    """Collects epochs of all buses and writes them in batches, at the latest after FLUSH_S of wall time.

    buses     codec by name in the log, one for each craft
    start_ns, interval_ns  when epochs are that do not say it themselves
    log       where the text goes, None to write none
    on_batch  is handed every batch as it is written: number of the bus, frames (live summary)

    With several buses an epoch is written when all have it, one bus after the other.
    """

    def __init__(
        self,
        buses: Mapping[str, Codec],
        start_ns: int,
        interval_ns: int,
        log: BinaryIO | None,
        on_batch: Callable[[int, FrameBatch], None] | None = None,
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
                batches.append((bus, epochs, blocks))
        if self._log is not None:
            self._log.write(self._text(batches))
            self._log.flush()
        if self._on_batch is not None:
            for bus, _, blocks in batches:
                self._on_batch(bus, concat(blocks))

    def _text(self, batches: list[tuple[int, list[int], list[FrameBatch]]]) -> bytes:
        """Log text of some epochs; of several buses epoch by epoch."""
        if len(batches) == 1:
            return self._lines(*batches[0])
        pieces = [
            (epoch, bus, self._lines(bus, [epoch], [block]))
            for bus, epochs, blocks in batches
            for epoch, block in zip(epochs, blocks, strict=True)
        ]
        return b"".join(text for _, _, text in sorted(pieces, key=lambda piece: piece[:2]))

    def _lines(self, bus: int, epochs: list[int], blocks: list[FrameBatch]) -> bytes:
        """Log text of epochs of one bus, which must come in order."""
        frames = concat(blocks)
        counts = np.array([len(block) for block in blocks])
        numbers = np.array(epochs, np.int64)
        waiting = self._waiting[bus]
        said = said_ns(waiting.codec, frames, counts, numbers)
        t_ns = marks_ns(said, numbers, self._interval_ns, waiting.anchor)
        waiting.anchor = int(numbers[-1]), int(t_ns[-1])
        unix_us = np.array([gpstime.to_unix_ns(t) // 1000 for t in t_ns.tolist()])
        return format_lines(stamps_us(unix_us, counts, frame_bits(frames)), frames, self._buses[bus])
