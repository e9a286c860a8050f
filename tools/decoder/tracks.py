"""What each channel delivers, since when, and what it is commanded to track: SV_CLOCK, COMMAND, ACK."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.common.limits import CHANNELS
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.block import Block
from gnss_hil.tools.decoder.command_log import exchanges

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
        self.sat = np.full(shape, NONE)
        self.since = np.zeros(shape, np.int64)
        self.asked = np.full(shape, NONE)

    def take(self, epochs: I64, block: Block) -> None:
        """The frames of epochs numbered (e,)."""
        grid = np.concatenate([self.sat[None], block.grid("SV_CLOCK", "satellite", NONE)])
        changed = grid[1:] != grid[:-1]
        last = len(epochs) - 1 - np.argmax(changed[::-1], axis=0)
        self.since = np.where(changed.any(axis=0), epochs[last], self.since)
        self.sat = grid[-1]
        for one in exchanges(block):
            at = one.receiver - 1, one.channel
            if one.kind == "COMMAND":
                self.asked[at] = one.sat if one.word == _TRACK else NONE
            elif one.word != _ACCEPTED and self.asked[at] == one.sat:
                self.asked[at] = NONE
