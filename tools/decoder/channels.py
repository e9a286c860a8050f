"""What channels measured: one row for each channel and epoch of which every frame came."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.messages import CHANNELS, HEADER_NAMES, MEASUREMENT_KINDS
from gnss_hil.tools.decoder.block import Block


@dataclass(frozen=True, slots=True, eq=False)
class Channels:
    """Rows (k,) in the order of epochs, receivers, channels.

    epoch      row of the block's epochs
    receiver   0-based;  channel
    sat        satellite index
    values     signals of the measurement kinds by name
    """

    epoch: NDArray[np.int64]
    receiver: NDArray[np.int64]
    channel: NDArray[np.int64]
    sat: NDArray[np.int64]
    values: dict[str, NDArray]

    @property
    def position_m(self) -> NDArray[np.float64]:
        """(k, 3) satellites at transmission, ECEF."""
        return np.stack([self.values[f"{axis}_m"] for axis in "xyz"], axis=-1)


def channels_of(block: Block) -> Channels:
    """The channels of which all measurement kinds came, each once."""
    kinds = [block[kind] for kind in MEASUREMENT_KINDS]
    cells = [
        (said.epoch * block.codec.receivers + said.number - 1) * CHANNELS + said["channel"] for said in kinds
    ]
    cell, rows = common(cells)
    values = {}
    for said, row in zip(kinds, rows, strict=True):
        for name in said.layout.signals:
            if name not in HEADER_NAMES and name != "channel":
                values[name] = said[name][row]
    antenna, channel = np.divmod(cell, CHANNELS)
    epoch, receiver = np.divmod(antenna, block.codec.receivers)
    return Channels(
        epoch, receiver, channel, satellites.index(values["sat_system"], values["sat_number"]), values
    )


def common(keys: Sequence[NDArray[np.int64]]) -> tuple[NDArray[np.int64], list[NDArray[np.intp] | slice]]:
    """Keys (k,) that every one of the arrays has exactly once, ascending, and where each array has them."""
    first = keys[0]
    if (first[1:] > first[:-1]).all() and all(np.array_equal(key, first) for key in keys[1:]):
        return first, [slice(None)] * len(keys)  # a bus without faults
    orders = [np.argsort(key, kind="stable") for key in keys]
    shared = None
    for key in keys:
        value, count = np.unique(key, return_counts=True)
        once = value[count == 1]
        shared = once if shared is None else np.intersect1d(shared, once, assume_unique=True)
    return shared, [
        order[np.searchsorted(key[order], shared)] for key, order in zip(keys, orders, strict=True)
    ]


def used_in_fix(block: Block) -> NDArray[np.bool_]:
    """(e, m, CHANNELS) whether a channel's pseudorange is in the fix, by NAV_USED."""
    used = np.zeros((block.epochs, block.codec.receivers, CHANNELS), bool)
    said = block["NAV_USED"]
    receiver = said["receiver"]
    inside = (receiver >= 1) & (receiver <= block.codec.receivers)
    bits = said["channels"][inside, None] >> np.arange(CHANNELS) & 1
    used[said.epoch[inside], receiver[inside] - 1] = bits.astype(bool)
    return used


def clock_domains(block: Block) -> NDArray[np.int64]:
    """(e, m) clock domain of each receiver, by TAG; 0 where it did not come."""
    domain = np.zeros((block.epochs, block.codec.receivers), np.int64)
    tags = block["TAG"]
    domain[tags.epoch, tags.number - 1] = tags["clock_domain"]
    return domain
