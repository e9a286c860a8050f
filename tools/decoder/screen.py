"""The protection checks of one bus, in batches of any size: every frame is checked once and counted."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import Index
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.dbc.contract.screening import Screened
from gnss_hil.tools.decoder.counters import Counters


def intact(codec: Codec, frames: FrameBatch, kind: str, number: int = 0) -> Index:
    """(k,) rows of the frames of a kind whose length and CRC are right, whatever their counters.

    For all that must know an epoch before its frames are checked: recorder, order of frames, replay.
    """
    rows = np.flatnonzero((frames.can_id == codec.can_id_of[kind, number]) & (frames.length == WIDTH))
    return rows[frames.data[rows, 0] == e2e.crc(frames.can_id[rows], frames.data[rows])]


class Screen:
    """State of the streams of one bus; counters of its frames."""

    def __init__(self, codec: Codec):
        self._codec = codec
        self._streams = e2e.fresh_counters(self._codec)
        self.counters = Counters()

    def take(self, frames: FrameBatch) -> Screened:
        """Frames (n,) in bus order, checked. Never raises on what a bus may carry."""
        screened = screening.screen(self._codec, frames, self._streams)
        self._streams = screened.counters
        self.counters.add(screened)
        return screened

    def forget(self) -> None:
        """Another session begins: counters of streams begin anew (docs/contract.md)."""
        self._streams = e2e.fresh_counters(self._codec)
