"""The recorder: every frame of a run into bus.log, as it happens.

A frame's stamp is the simulated instant its first bit is on the bus: UNIX time of the epoch's mark plus the
exact length, stuff bits included, of the frames before it in the epoch (`dbc.bits`).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import BinaryIO

import numpy as np

from dbc import gpstime
from dbc.bits import frame_bits
from dbc.contract import BIT_RATE
from dbc.frames import FrameBatch, concat
from tools.candump import format_lines

BATCH_FRAMES = 16_384
FLUSH_S = 0.5
_US_PER_BIT = 1_000_000 // BIT_RATE


def stamps_us(mark_unix_us: np.ndarray, counts: np.ndarray, bits: np.ndarray) -> np.ndarray:
    """(n,) UNIX times [us] of frames whose epochs begin at mark_unix_us (e,) and hold counts (e,) frames."""
    before = np.cumsum(bits) - bits
    starts = np.cumsum(counts) - counts
    offset = before - np.repeat(before[np.minimum(starts, len(bits) - 1)], counts)
    return np.repeat(mark_unix_us, counts) + offset * _US_PER_BIT


class Recorder:
    """Collects epochs of one bus and writes them in batches, at the latest after FLUSH_S of wall time.

    log       where the text goes, None to write none
    on_batch  is handed every batch as it is written (live summary)
    """

    def __init__(
        self,
        bus: str,
        start_ns: int,
        interval_ns: int,
        log: BinaryIO | None,
        on_batch: Callable[[FrameBatch], None] | None = None,
    ):
        self._bus = bus
        self._start_ns = start_ns
        self._interval_ns = interval_ns
        self._log = log
        self._on_batch = on_batch
        self._epochs: list[int] = []
        self._blocks: list[FrameBatch] = []
        self._counts: list[int] = []
        self._waiting = 0
        self._written_at = time.monotonic()
        self.frames = 0

    def add(self, epoch: int, frames: FrameBatch) -> None:
        """The frames of an epoch in canonical order."""
        self._epochs.append(epoch)
        self._blocks.append(frames)
        self._counts.append(len(frames))
        self._waiting += len(frames)
        self.frames += len(frames)
        if self._waiting >= BATCH_FRAMES or time.monotonic() - self._written_at > FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Write what is waiting."""
        self._written_at = time.monotonic()
        if not self._waiting:
            return
        frames = concat(self._blocks)
        if self._log is not None:
            marks_ns = self._start_ns + np.array(self._epochs, np.int64) * self._interval_ns
            unix_us = np.array([gpstime.to_unix_ns(int(t)) // 1000 for t in marks_ns])
            stamps = stamps_us(unix_us, np.array(self._counts), frame_bits(frames))
            self._log.write(format_lines(stamps, frames, self._bus))
            self._log.flush()
        if self._on_batch is not None:
            self._on_batch(frames)
        self._epochs, self._blocks, self._counts, self._waiting = [], [], [], 0
