"""A bus while it goes on: every frame is checked and counted, and the last epoch is there at once.

Who watches cannot wait for late answers as the digest does: a frame of the epoch before stays in the epoch in
which it was heard.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gnss_hil.dbc.contract.bits import frame_bits
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.contract.messages import BIT_RATE
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.decoder.block import EPOCHS, Block, epoch_nibbles, of_frames, payloads
from gnss_hil.tools.decoder.counters import Counters
from gnss_hil.tools.decoder.screen import Screen
from gnss_hil.tools.decoder.tracks import Tracks

_LATE = 2
"""A frame of the epoch before is an answer that came while this one had begun; older ones are of no epoch."""


class Latest:
    """One bus since the start, looked at now and then.

    tracks             what its channels do
    load_percent       mean of the epochs of the last look
    load_most_percent  of any epoch
    """

    def __init__(self, codec: Codec, interval_s: float):
        self._codec = codec
        self._bits_per_epoch = BIT_RATE * interval_s
        self._screen = Screen(codec)
        self.tracks = Tracks(codec)
        self.load_percent = self.load_most_percent = 0.0

    @property
    def counters(self) -> Counters:
        return self._screen.counters

    def take(self, epochs: Sequence[int], blocks: Sequence[FrameBatch]) -> Block:
        """Numbers of some epochs (e,), one at least, and the frames of each; the last one, decoded."""
        frames = concat(blocks)
        numbers = np.array(epochs, np.int64)
        row = np.repeat(np.arange(len(numbers)), [len(block) for block in blocks])
        bits = np.bincount(row, frame_bits(frames), minlength=len(numbers))
        self.load_percent = 100 * float(bits.mean()) / self._bits_per_epoch
        self.load_most_percent = max(self.load_most_percent, 100 * float(bits.max()) / self._bits_per_epoch)
        screened = self._screen.take(frames)
        row = row[screened.verdict <= Verdict.LOST]
        frames = screened.frames
        late = (numbers[row] - epoch_nibbles(payloads(frames))) % EPOCHS
        own = late < _LATE
        self.counters.reject("MIXED_EPOCH", int((~own).sum()))
        frames, row = frames[own], row[own]
        self.tracks.take(numbers, of_frames(self._codec, frames, row, len(numbers)))
        return of_frames(self._codec, frames[row == len(numbers) - 1])
