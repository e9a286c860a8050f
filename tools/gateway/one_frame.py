"""Signals of single frames: what a codec of whole blocks would cost more for than they are worth."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch


class Reader:
    """Reads raw unsigned signals of one protected kind of message that is nobody's own."""

    def __init__(self, codec: Codec, kind: str, *signals: str):
        layout = codec.kinds[kind]
        at = [layout.signals.index(name) for name in signals]
        self._fields = [(int(layout.shift[i]), int(layout.mask[i])) for i in at]
        self._can_id = codec.can_id_of[kind, 0]

    def rows(self, frames: FrameBatch) -> list[int]:
        """Rows that hold frames of this kind."""
        return np.flatnonzero(frames.can_id == self._can_id).tolist()

    def read(self, frames: FrameBatch, row: int) -> list[int] | None:
        """The signals of one such row; None if it is not whole and intact."""
        payload = frames.data[row : row + 1]
        if frames.length[row] != WIDTH or payload[0, 0] != e2e.crc(frames.can_id[row], payload)[0]:
            return None
        word = int.from_bytes(payload.tobytes(), "little")
        return [word >> shift & mask for shift, mask in self._fields]

    def first(self, frames: FrameBatch) -> list[int] | None:
        """Those of the first such row; None if there is none, or if it is not intact."""
        rows = self.rows(frames)
        return self.read(frames, rows[0]) if rows else None
