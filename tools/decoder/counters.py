"""What passed on one bus since the last look. Every frame is screened, in batches: no fault is missed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.tools.live.tracks import Tracks

_LATE = 2
"""A frame of the epoch before is an answer that came while this one had begun; older ones are of no epoch."""


class Tally:
    """Counts of one bus, and what its channels do.

    frames, lost, rejected  since the start; lost by the counters of their streams, rejected by reason
    load_percent            mean of the epochs of the last look
    load_most_percent       of any epoch
    """

    def __init__(self, codec: Codec, interval_s: float):
        self._codec = codec
        self._bits_per_epoch = BIT_RATE * interval_s
        self._counters = e2e.fresh_counters()
        self.tracks = Tracks(codec)
        self.frames = self.lost = 0
        self.rejected: Counter[str] = Counter()
        self.load_percent = self.load_most_percent = 0.0

    def take(self, epochs: Sequence[int], blocks: Sequence[FrameBatch]) -> FrameBatch:
        """Some epochs (e,) and the frames of each; the accepted frames of the last one."""
        frames = concat(blocks)
        row = np.repeat(np.arange(len(epochs)), [len(block) for block in blocks])
        screened = e2e.screen(self._codec, frames, self._counters)
        self._counters = screened.counters
        accepted = screened.verdict <= e2e.Verdict.LOST
        mixed = accepted.copy()
        nibble = np.array(epochs, np.int64)[row] % 16
        mixed[accepted] = (nibble[accepted] - (frames.data[accepted, 1] >> 4)) % 16 >= _LATE
        self.frames += len(frames)
        self.lost += screened.lost
        self.rejected["MIXED_EPOCH"] += int(mixed.sum())
        for verdict, count in enumerate(np.bincount(screened.verdict)):
            if count and verdict > e2e.Verdict.LOST:
                self.rejected[e2e.Verdict(verdict).name] += int(count)
        bits = np.bincount(row, frame_bits(frames), minlength=len(epochs))
        self.load_percent = 100 * float(bits.mean()) / self._bits_per_epoch
        self.load_most_percent = max(self.load_most_percent, 100 * float(bits.max()) / self._bits_per_epoch)
        good = accepted & ~mixed
        kept, row = frames[good], row[good]
        self.tracks.take(np.array(epochs), row, kept)
        return kept[row == len(epochs) - 1]

    @property
    def faults(self) -> dict[str, int]:
        """Rejected frames by reason, only reasons that occurred."""
        return {reason: count for reason, count in sorted(self.rejected.items()) if count}
