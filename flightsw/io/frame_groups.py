"""Frames that carry one record together, and where each frame of a block goes.

A record (a channel's measurement, a satellite's almanac, the time mark) is spread over several frames. All
records of a block are gathered through one table of slots: the rows of a block are written into it by
identifier and key, and a record is complete when all of its slots are filled.

Of most groups the key is the one that names the protected stream, and receivers send the same streams epoch
after epoch: where their frames go, and the signals of all of them, are one plan that is kept. Almanac frames
have the satellite for a key, which goes on from epoch to epoch. The plan takes those of a sender for one
record; where they are not, they are gathered anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I32, I64, U64, Bool, Index
from gnss_hil.dbc.common.limits import CHANNELS, MAX_RECEIVERS
from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.dbc.contract.batch_codec import Reader, joined, reader
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.messages import MEASUREMENT_KINDS
from gnss_hil.flightsw.io.missing_channels import accounted

IONOSPHERE = tuple(f"{name}{k}" for name in ("alpha", "beta") for k in range(4))
XYZ, VXYZ = ("x_m", "y_m", "z_m"), ("vx_mps", "vy_mps", "vz_mps")

_KINDS: dict[str, tuple[Sequence[str], int, Sequence[str]]] = {
    # group: (kinds of its frames, keys of one sender, signals that are read)
    "mark": (
        ("TIME_MARK", "TIME_GPS", "TIME_FINE"),
        1,
        ("session", "epoch", "week", "second", "nanosecond", "leap", "mark_clock"),
    ),
    "attitude": (
        ("ATT_Q01", "ATT_Q23", "ATT_RATE"),
        1,
        ("q0", "q1", "q2", "q3", "wx_rps", "wy_rps", "wz_rps"),
    ),
    "measurement": (
        MEASUREMENT_KINDS,
        CHANNELS,
        (
            *(*XYZ, *VXYZ, "pseudorange_m", "range_rate_mps", "clock_m", "clock_drift_mps", "cn0_dbhz"),
            *("lock", "health", "ura", "frequency", "signal", "sat_system", "sat_number"),
        ),
    ),
    "ack": (("ACK",), CHANNELS, ("result", "sat_system", "sat_number", "transaction")),
    "receiver": (("TAG", "STATUS", "HEARTBEAT"), 1, ("boot_count", "clock_domain", "frames")),
    "ionosphere": (("IONO_ALPHA", "IONO_BETA"), 1, IONOSPHERE),
    "almanac": (
        ("ALM_XY", "ALM_Z", "ALM_V"),
        SATELLITES,
        (*XYZ, *VXYZ, "health", "sat_system", "sat_number"),
    ),
}

ALMANAC, MARK = "almanac", _KINDS["mark"][0]
STATUS = _KINDS["receiver"][0].index("STATUS")
"""Which frame of a receiver's record it is."""


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Slots of one group: from `first` stand the first frames of all `keys` keys, then all second ones, up to
    `frames` of them.

    keys     senders times keys of one sender: receiver and channel, or receiver and satellite
    """

    first: int
    senders: int
    keys_of_sender: int
    frames: int
    reader: Reader

    @property
    def keys(self) -> int:
        return self.senders * self.keys_of_sender

    @property
    def end(self) -> int:
        return self.first + self.keys * self.frames


@dataclass(frozen=True, slots=True, eq=False)
class GroupTable:
    """Where frames go.

    slot_of   (streams,) slot of each protected stream's frames, of the almanac's the first one: theirs is by
              the satellite; -1 where a stream belongs to no group
    slots     of all groups; those of the almanac are the last
    """

    groups: Mapping[str, Group]
    slots: int
    slot_of: I64


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Complete records of one group in a block, (n,), ascending by sender and key.

    sender   0-based: receiver
    key      channel or satellite
    rows     (frames, n) rows of the block that carry it
    """

    sender: I64
    key: I64
    rows: I32

    def __len__(self) -> int:
        return len(self.key)


@cache
def group_table(codec: Codec) -> GroupTable:
    slot_of = np.full(codec.streams, -1, np.int64)
    groups: dict[str, Group] = {}
    first = 0
    for name, (kinds, keys, signals) in _KINDS.items():
        senders = [n for kind, n in codec.can_id_of if kind == kinds[0] and n <= MAX_RECEIVERS]
        group = Group(first, max(1, *senders), keys, len(kinds), reader(codec, kinds, signals))
        for frame, kind in enumerate(kinds):
            for sender in senders:
                can_id = codec.can_id_of[kind, sender]
                slot = first + frame * group.keys + max(sender - 1, 0) * keys
                streams = int(codec.key_mask_of[can_id]) + 1
                begin = codec.first_stream_of[can_id]
                slot_of[begin : begin + streams] = slot + np.arange(streams)
        groups[name] = group
        first = group.end
    return GroupTable(groups, first, slot_of)


def complete(filled: I32, group: Group) -> Records:
    """Records of a group all of whose frames are there; filled (slots of the group,) row of the block in each
    slot, -1 where it is empty."""
    rows = filled.reshape(group.frames, group.keys)
    (key,) = (rows[-1] >= 0).nonzero()
    rows = rows.take(key, axis=1)
    if len(key) and rows.min() < 0:
        whole: Bool = rows.min(axis=0) >= 0
        key, rows = key[whole], rows[:, whole]
    sender, key = np.divmod(key, group.keys_of_sender)
    return Records(sender, key, rows)


def rows_by_slot(slots: int, slot: I64, rows: Index) -> I32:
    """(slots,) row of the block in each slot, -1 where it is empty; of two rows for a slot the first stands.

    slot, rows   (n,) slots of the frames of some rows, ascending
    """
    filled = np.full(slots, -1, np.int32)
    backwards = slice(None, None, -1)
    filled[slot[backwards]] = rows[backwards]
    return filled


@dataclass(frozen=True, slots=True, eq=False)
class Unused:
    """Rows of frames that no complete record holds: another one has their slot, or others are missing."""

    surplus: Index
    incomplete: Index


def unused(filled: I32, slot: I64, rows: Index, found: Iterable[Records]) -> Unused:
    """Of frames (n,) in some rows, their slots, the row that has each slot, and the records found."""
    standing = filled[slot] == rows
    left = np.zeros(int(rows.max(initial=-1)) + 1, bool)
    left[rows[standing]] = True
    for records in found:
        left[records.rows] = False
    return Unused(rows[~standing], np.flatnonzero(left))


@dataclass(frozen=True, slots=True, eq=False)
class BlockPlan:
    """Where the frames of a block go whose streams are these.

    records   complete ones, of all groups but the almanac
    almanac   (a,) rows of almanac frames, and their first slots
    single    the almanac records if each sender has sent one, of satellite 0; None if more or less came
    unused    rows of the other groups' frames
    accounted   (n receivers' records,) what their STATUS counts if these are all that they sent
    """

    records: Mapping[str, Records]
    almanac: Index
    almanac_slot: I64
    single: Records | None
    unused: Unused
    accounted: I64
    _reader: Reader
    _row: Index
    _spans: Mapping[str, tuple[slice, int]]

    def values(self, words: U64) -> dict[str, F64]:
        """By group (s, n): the signals that are read, of all records; words (n,) are the block's payloads."""
        values = self._reader.read(words.take(self._row))
        return {name: values[span].reshape(s, -1) for name, (span, s) in self._spans.items()}


def block_plan(codec: Codec, stream: I64) -> BlockPlan:
    """Of frames of the protected streams (n,), in this order."""
    return _plan(codec, stream.tobytes())


@lru_cache(maxsize=32)
def _plan(codec: Codec, streams: bytes) -> BlockPlan:
    table = group_table(codec)
    slot = table.slot_of[np.frombuffer(streams, np.int64)]
    of_almanac = slot >= table.groups[ALMANAC].first
    rows = np.flatnonzero((slot >= 0) & ~of_almanac)
    filled = rows_by_slot(table.slots, slot[rows], rows)
    groups = {name: group for name, group in table.groups.items() if name != ALMANAC}
    records = {name: complete(filled[group.first : group.end], group) for name, group in groups.items()}
    almanac = np.flatnonzero(of_almanac)
    almanac_slot = slot[almanac] - table.groups[ALMANAC].first
    single = _single(table.groups[ALMANAC], almanac, almanac_slot)
    read = records if single is None else {**records, ALMANAC: single}
    readers = {name: table.groups[name].reader for name in read}
    row = [found.rows[readers[name].frame].ravel() for name, found in read.items()]
    ends = np.cumsum([0, *map(len, row)]).tolist()
    spans = {
        name: (slice(begin, end), len(readers[name].names))
        for name, begin, end in zip(read, ends[:-1], ends[1:], strict=True)
    }
    return BlockPlan(
        records=records,
        almanac=almanac,
        almanac_slot=almanac_slot,
        single=single,
        unused=unused(filled, slot[rows], rows, records.values()),
        accounted=accounted(_channels_heard(filled, table.groups["measurement"])[records["receiver"].sender]),
        _reader=joined([(readers[name], len(found)) for name, found in read.items()]),
        _row=np.concatenate(row).astype(np.intp),
        _spans=spans,
    )


def _channels_heard(filled: I32, group: Group) -> I64:
    """(senders,) channels of which any frame is there."""
    rows = filled[group.first : group.end].reshape(group.frames, group.senders, group.keys_of_sender)
    return (rows >= 0).any(axis=0).sum(axis=1)


def _single(group: Group, rows: Index, slot: I64) -> Records | None:
    """One record of each sender from almanac frames in some rows, by their first slots (a,)."""
    frame, sender = np.divmod(slot // group.keys_of_sender, group.senders)
    filled = np.full((group.frames, group.senders), -1, np.int32)
    filled[frame, sender] = rows
    (whole,) = (filled.min(axis=0) >= 0).nonzero()
    found = Records(whole, np.zeros_like(whole), filled[:, whole])
    return found if found.rows.size == len(rows) else None


def _satellite(words: U64) -> I64:
    """The key of almanac frames."""
    return words.view(np.int64) >> 16 & SATELLITES - 1


def almanac_records(
    codec: Codec, plan: BlockPlan, words: U64, values: Mapping[str, F64]
) -> tuple[Records, F64, Unused]:
    """Records of the almanac in a block (n records), their signals (s, n), and what none of them holds.

    words, values   payloads of the block, and what the plan read of them
    """
    single = plan.single
    if single is not None:
        key = _satellite(words.take(single.rows))
        if (key == key[0]).all():
            return Records(single.sender, key[0], single.rows), values[ALMANAC], NONE_UNUSED
    group, rows = group_table(codec).groups[ALMANAC], plan.almanac
    slot = plan.almanac_slot + _satellite(words.take(rows))
    filled = rows_by_slot(group.keys * group.frames, slot, rows)
    found = complete(filled, group)
    left = NONE_UNUSED if found.rows.size == len(rows) else unused(filled, slot, rows, [found])
    return found, group.reader.read(words.take(found.rows.take(group.reader.frame, axis=0))), left


NONE_UNUSED = Unused(np.zeros(0, np.intp), np.zeros(0, np.intp))
