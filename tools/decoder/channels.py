"""What channels measured: one row for each channel and epoch of which every frame came."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import F64, I64, Bool, Index
from gnss_hil.dbc.common.limits import CHANNELS
from gnss_hil.dbc.contract.messages import HEADER_NAMES, MEASUREMENT_KINDS
from gnss_hil.tools.decoder.block import Block


@dataclass(frozen=True, slots=True, eq=False)
class Channels:
    """Rows (k,) in the order of epochs, receivers, channels.

    epoch      row of the block's epochs
    receiver   0-based;  channel
    sat        satellite index
    values     signals of the measurement kinds by name
    """

    epoch: I64
    receiver: I64
    channel: I64
    sat: I64
    values: dict[str, NDArray]

    @property
    def position_m(self) -> F64:
        """(k, 3) satellites at transmission, ECEF."""
        return np.stack([self.values[f"{axis}_m"] for axis in "xyz"], axis=-1)


def channels_of(block: Block) -> Channels:
    """The channels of which all measurement kinds came, each once."""
    kinds = [block[kind] for kind in MEASUREMENT_KINDS]
    receivers = block.codec.receivers
    cell, rows = common(
        [(frames.epoch * receivers + frames.number - 1) * CHANNELS + frames["channel"] for frames in kinds]
    )
    values = {
        name: frames[name][row]
        for frames, row in zip(kinds, rows, strict=True)
        for name in frames.layout.signals
        if name not in HEADER_NAMES and name != "channel"
    }
    antenna, channel = np.divmod(cell, CHANNELS)
    epoch, receiver = np.divmod(antenna, receivers)
    satellite = satellites.index(values["sat_system"], values["sat_number"])
    return Channels(epoch, receiver, channel, satellite, values)


def common(keys: Sequence[I64]) -> tuple[I64, list[Index | slice]]:
    """Keys (k,) that every one of the arrays has exactly once, ascending, and where each array has them."""
    first = keys[0]
    if (first[1:] > first[:-1]).all() and all(np.array_equal(key, first) for key in keys[1:]):
        return first, [slice(None)] * len(keys)  # a bus without faults
    shared = reduce(np.intersect1d, (_once(key) for key in keys))
    orders = [np.argsort(key, kind="stable") for key in keys]
    places = zip(keys, orders, strict=True)
    return shared, [order[np.searchsorted(key[order], shared)] for key, order in places]


def _once(key: I64) -> I64:
    """Values that occur exactly once, ascending."""
    value, count = np.unique(key, return_counts=True)
    return value[count == 1]


def used_in_fix(block: Block) -> Bool:
    """(e, m, CHANNELS) whether a channel's pseudorange is in the fix, by NAV_USED."""
    used = np.zeros((block.epochs, block.codec.receivers, CHANNELS), bool)
    frames = block["NAV_USED"]
    receiver = frames["receiver"]
    inside = (receiver >= 1) & (receiver <= block.codec.receivers)
    bits = frames["channels"][inside, None] >> np.arange(CHANNELS) & 1
    used[frames.epoch[inside], receiver[inside] - 1] = bits.astype(bool)
    return used


def lists_used(block: Block) -> Bool:
    """(e,) whether any NAV_USED came: without one nobody says which channels are in the fix."""
    return np.bincount(block["NAV_USED"].epoch, minlength=block.epochs) > 0
