"""Frames that carry one record together, and where each frame of a block goes.

A record (a channel's measurement, a satellite's almanac, the time mark) is spread over several frames. All
records of a block are gathered through one table of slots: the rows of a block are written into it by
identifier and key, and a record is complete when all of its slots are filled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I32, I64, U64, Bool, Index
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.dbc.contract.batch_codec import Reader, reader
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.messages import CHANNELS, MAX_RECEIVERS, MEASUREMENT_KINDS

_KINDS: dict[str, tuple[Sequence[str], int]] = {
    # group: (kinds of its frames, keys of one sender)
    "mark": (("TIME_MARK", "TIME_GPS", "TIME_FINE"), 1),
    "attitude": (("ATT_Q01", "ATT_Q23", "ATT_RATE"), 1),
    "measurement": (MEASUREMENT_KINDS, CHANNELS),
    "almanac": (("ALM_XY", "ALM_Z", "ALM_V"), SATELLITES),
    "ack": (("ACK",), CHANNELS),
    "receiver": (("TAG", "STATUS", "HEARTBEAT"), 1),
}


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Slots of one group: from `first` stand the first frames of all `keys` keys, then all second ones, up to
    `frames` of them.

    keys     senders times keys of one sender: receiver and channel, or receiver and satellite
    column   signal name -> (frame of the record, column of the reader)
    """

    first: int
    keys: int
    frames: int
    column: dict[str, tuple[int, int]]

    @property
    def slots(self) -> slice:
        return slice(self.first, self.first + self.keys * self.frames)


@dataclass(frozen=True, slots=True, eq=False)
class GroupTable:
    """Where each identifier's frames go. A frame's slot is slot_of + key, key = (word >> 16) & key_mask: the
    channel, or the 9 bits of satellite system and number; every kind that has a key begins with it.

    slot_of, key_mask   (IDENTIFIERS,); slot_of is -1 where an identifier belongs to no group
    """

    reader: Reader
    groups: dict[str, Group]
    slots: int
    slot_of: I64
    key_mask: I64


@dataclass(frozen=True, slots=True, eq=False)
class Complete:
    """Complete records of one group in a block.

    group   whose records these are
    key     (n,) key of each record, ascending
    rows    (frames, n) rows of the block that carry it
    """

    group: Group
    key: Index
    rows: I32

    def __len__(self) -> int:
        return len(self.key)

    def signals(self, values: F64) -> dict[str, F64]:
        """Every signal of the group, (n,), out of the values (rows of the block, columns)."""
        found = values.take(self.rows, axis=0)
        return {name: found[frame, :, column] for name, (frame, column) in self.group.column.items()}


@cache
def group_table(codec: Codec) -> GroupTable:
    slot_of, key_mask = np.full(IDENTIFIERS, -1, np.int64), np.zeros(IDENTIFIERS, np.int64)
    everything = reader(codec, [kind for kinds, _ in _KINDS.values() for kind in kinds])
    groups: dict[str, Group] = {}
    first = 0
    for name, (kinds, keys) in _KINDS.items():
        senders = [n for kind, n in codec.can_id_of if kind == kinds[0] and n <= MAX_RECEIVERS]
        count = keys * max(1, *senders)
        column: dict[str, tuple[int, int]] = {}
        for frame, kind in enumerate(kinds):
            column |= {signal: (frame, k) for k, signal in enumerate(everything.signals[kind])}
            for sender in senders:
                can_id = codec.can_id_of[kind, sender]
                slot_of[can_id] = first + frame * count + max(sender - 1, 0) * keys
                key_mask[can_id] = keys - 1
        groups[name] = Group(first, count, len(kinds), column)
        first += count * len(kinds)
    return GroupTable(everything, groups, first, slot_of, key_mask)


def slots(table: GroupTable, can_id: I64, words: U64) -> I64:
    """(n,) slot of each frame; its identifier must belong to a group."""
    return table.slot_of[can_id] + ((words >> np.uint64(16)).view(np.int64) & table.key_mask[can_id])


def rows_by_slot(table: GroupTable, slot: I64, rows: Index) -> I32:
    """(slots,) row of the block in each slot, -1 where it is empty; of two rows the first stands.

    slot   (n,) of all rows of the block
    rows   those that count
    """
    filled = np.full(table.slots, -1, np.int32)
    backwards = rows[::-1]
    filled[slot[backwards]] = backwards
    return filled


def complete(filled: I32, group: Group) -> Complete:
    """Records of a group all of whose frames are there."""
    rows = filled[group.slots].reshape(group.frames, group.keys)
    (key,) = (rows[-1] >= 0).nonzero()
    rows = rows.take(key, axis=1)
    if len(key) and rows.min() < 0:
        whole: Bool = rows.min(axis=0) >= 0
        key, rows = key[whole], rows[:, whole]
    return Complete(group, key, rows)
