"""What each channel delivers and since when, and what it was told to do: from SV_CLOCK, COMMAND and ACK."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import CHANNELS, VALUES

_TRACK = {label: raw for raw, label in VALUES["Action"].items()}["TRACK"]
_ACCEPTED = {label: raw for raw, label in VALUES["AckResult"].items()}["ACCEPTED"]

NONE = -1


class Tracks:
    """Channels of all receivers of a bus.

    sat     (m, CHANNELS) satellite that the last epoch delivered, NONE where nothing came
    since   (m, CHANNELS) epoch from which it has come without a gap
    asked   (m, CHANNELS) satellite that the channel was last commanded to track, NONE if none
    """

    def __init__(self, codec: Codec):
        shape = (codec.receivers, CHANNELS)
        self._codec = codec
        self.sat = np.full(shape, NONE)
        self.since = np.zeros(shape, np.int64)
        self.asked = np.full(shape, NONE)

    def take(self, epochs: NDArray[np.int64], row: NDArray[np.int64], frames: FrameBatch) -> None:
        """Accepted frames (n,) of epochs (e,), row (n,) the epoch each belongs to."""
        at, receiver, said = self._of_kind("SV_CLOCK", row, frames)
        grid = np.full((len(epochs) + 1, *self.sat.shape), NONE)
        grid[0] = self.sat
        grid[at + 1, receiver, said["channel"]] = satellites.index(said["sat_system"], said["sat_number"])
        changed = grid[1:] != grid[:-1]
        last = len(epochs) - 1 - np.argmax(changed[::-1], axis=0)
        self.since = np.where(changed.any(axis=0), epochs[last], self.since)
        self.sat = grid[-1]
        self._obey(row, frames)

    def _obey(self, row: NDArray[np.int64], frames: FrameBatch) -> None:
        """Answers are to commands of an epoch before: within an epoch they come first."""
        events = []
        for order, (kind, says) in enumerate((("ACK", "result"), ("COMMAND", "action"))):
            at, receiver, said = self._of_kind(kind, row, frames)
            sat = satellites.index(said["sat_system"], said["sat_number"])
            columns = (at, receiver, said["channel"], said[says], sat)
            events += [(e, order, *rest) for e, *rest in zip(*(c.tolist() for c in columns), strict=True)]
        for _, order, receiver, channel, says, sat in sorted(events, key=lambda event: event[:2]):
            if order:
                self.asked[receiver, channel] = sat if says == _TRACK else NONE
            elif says != _ACCEPTED and self.asked[receiver, channel] == sat:
                self.asked[receiver, channel] = NONE

    def _of_kind(self, kind: str, row: NDArray[np.int64], frames: FrameBatch):
        """Rows, receivers (0-based) and signals of the frames of a kind."""
        mine = self._codec.kind_of[frames.can_id] == self._codec.kinds[kind].number
        receiver = self._codec.number_of[frames.can_id[mine]].astype(np.int64) - 1
        return row[mine], receiver, self._codec.decode(kind, frames.data[mine])
