"""Arrows 2->3, 2->7 and 4->5 of RU 2706636 C1: the frames of an epoch as measurements, attitude, almanac.

Nothing here raises on what a bus may carry. What cannot be used is counted by reason and identifier, with
its consequence. The rules:

- A frame passes `dbc.contract.e2e.screen` (form, CRC, counter) and carries the epoch of the time mark, or
  is rejected.
- Of two frames that say the same thing in one epoch the first stands.
- A channel counts when all its ten frames are there; a lost frame takes out its own channel, nothing else.
  So a status that announces more frames than came changes nothing: the missing ones have done their harm.
- A node whose heartbeat names another contract is not used at all in that block.
- Without a complete time mark of a time that exists nothing else of the block is used: an epoch without a
  time is no epoch.
- The mark is the last one in the block; if a link merged two blocks, the older epoch's frames are rejected.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.satellites import NUMBERS, SATELLITES
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.batch_codec import Reader, reader
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.e2e import Verdict
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import CHANNELS, MAX_RECEIVERS, MEASUREMENT_KINDS
from gnss_hil.flightsw.io import node_monitor
from gnss_hil.flightsw.io.epoch import (
    Acks,
    AlmanacRows,
    AttitudeReport,
    Epoch,
    Mark,
    Measurements,
    nothing,
)
from gnss_hil.flightsw.io.frame_statistics import Reason, Tally

LAST_WEEK = np.iinfo(np.int64).max // gpstime.NS_PER_WEEK - 1
"""The last whole week, 15249 (AD 2272), that 64 bits of nanoseconds can tell."""


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Frames that say one thing together: `width` of them for each of `keys` keys. From `base` in the slot
    table stand all first frames in the order of keys, then all second ones, and so on.

    where   signal name -> (frame of the group, column of the reader)
    """

    base: int
    keys: int
    width: int
    where: dict[str, tuple[int, int]]


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Where each identifier's frames go. A frame's slot is base + key, key = (word >> 16) & mask: the channel
    or the 9 bits of satellite system and number; every kind that has a key begins with it."""

    reader: Reader
    groups: dict[str, Group]
    slots: int
    base_of: NDArray[np.int64]
    mask_of: NDArray[np.int64]


_GROUPS: dict[str, tuple[tuple[str, ...], int]] = {
    # name: (kinds, keys of one sender)
    "mark": (("TIME_MARK", "TIME_GPS", "TIME_FINE"), 1),
    "attitude": (("ATT_Q01", "ATT_Q23", "ATT_RATE"), 1),
    "measurement": (MEASUREMENT_KINDS, CHANNELS),
    "almanac": (("ALM_XY", "ALM_Z", "ALM_V"), SATELLITES),
    "ack": (("ACK",), CHANNELS),
    "receiver": (("TAG", "STATUS", "HEARTBEAT"), 1),
}


@cache
def plan(codec: Codec) -> Plan:
    base_of = np.full(IDENTIFIERS, -1, np.int64)
    mask_of = np.zeros(IDENTIFIERS, np.int64)
    everything = reader(codec, [kind for kinds, _ in _GROUPS.values() for kind in kinds])
    groups, base = {}, 0
    for name, (kinds, keys) in _GROUPS.items():
        numbers = [n for kind, n in codec.can_id_of if kind == kinds[0] and n <= MAX_RECEIVERS]
        count = keys * max(1, *numbers)
        where = {}
        for position, kind in enumerate(kinds):
            where |= {signal: (position, k) for k, signal in enumerate(everything.signals[kind])}
            for number in numbers:
                can_id = codec.can_id_of[kind, number]
                base_of[can_id] = base + position * count + max(number - 1, 0) * keys
                mask_of[can_id] = keys - 1
        groups[name] = Group(base, count, len(kinds), where)
        base += count * len(kinds)
    return Plan(everything, groups, base, base_of, mask_of)


def intake(
    codec: Codec, frames: FrameBatch, counters: NDArray[np.int8], rejected: NDArray[np.int64]
) -> tuple[Epoch, NDArray[np.int8], NDArray[np.int64]]:
    """The epoch in a block of frames.

    counters   receiver state of the protection
    rejected   (REASONS, IDENTIFIERS) counts so far
    returns    the epoch, the next counters, the next counts; arguments are not modified
    """
    screened = e2e.screen(codec, frames, counters)
    tally = Tally(rejected)
    tally.add(screened.verdict, frames.can_id & SFF_MASK, screened.verdict > Verdict.OK)
    node_monitor.count_silent(codec, screened.frames, counters, tally)
    where, good = plan(codec), node_monitor.of_our_contract(codec, screened.frames, tally)
    base = where.base_of[good.can_id]
    if not (base >= 0).all():
        good = good[base >= 0]
        base = base[base >= 0]
    can_id = good.can_id
    words = np.ascontiguousarray(good.data).view("<u8")[:, 0].view(np.int64)
    nibble = good.data[:, 1] >> 4

    mark_nibble = _nibble_of_mark(codec, can_id, nibble)
    rows = np.flatnonzero(nibble == mark_nibble)

    # Written backwards, so that of two frames with one slot the first stands.
    slot = base + ((words >> 16) & where.mask_of[can_id])
    table = np.full(where.slots, -1, np.int32)
    backwards = rows[::-1]
    table[slot[backwards]] = backwards
    complete = {name: _complete(table, group) for name, group in where.groups.items()}
    values = where.reader.read(can_id, words.view(np.uint64))

    def read(name: str) -> tuple[NDArray[np.intp], dict[str, NDArray[np.float64]]]:
        keys, group = complete[name]
        found = values[group]
        return keys, {signal: found[k, :, c] for signal, (k, c) in where.groups[name].where.items()}

    marks, said = read("mark")
    mark = _mark(marks, said, mark_nibble)
    if mark is None:
        bad = np.zeros(len(good), bool)
        bad[complete["mark"][1]] = True
        tally.add(Reason.BAD_TIME_MARK, can_id, bad)
        tally.add(Reason.NO_TIME_MARK, can_id, ~bad)
        return nothing(screened.lost), screened.counters, tally.counts
    if len(rows) < len(good):
        tally.add(Verdict.MIXED_EPOCH, can_id, nibble != mark_nibble)
    if sum(group.size for _, group in complete.values()) < len(rows):
        _count_left(tally, can_id, rows, slot, table, complete)
    epoch = Epoch(
        mark,
        _attitude(*read("attitude")),
        _measurements(*read("measurement")),
        _almanac(*read("almanac")),
        _acks(*read("ack")),
        *_receivers(*read("receiver")),
        screened.lost,
    )
    return epoch, screened.counters, tally.counts


def _nibble_of_mark(codec: Codec, can_id: NDArray, nibble: NDArray[np.uint8]) -> int:
    """Epoch modulo 16 of the last TIME_MARK; -1, which no frame has, without one."""
    opens = np.flatnonzero(can_id == codec.can_id_of["TIME_MARK", 0])
    return int(nibble[opens[-1]]) if len(opens) else -1


def _complete(table: NDArray[np.int32], group: Group) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Keys (n,) of a group all of whose frames are there, and their rows (width, n)."""
    rows = table[group.base : group.base + group.keys * group.width].reshape(group.width, group.keys)
    keys = np.flatnonzero(rows[-1] >= 0)
    rows = rows[:, keys]
    if group.width > 1 and len(keys) and rows.min() < 0:
        whole = rows.min(axis=0) >= 0
        keys, rows = keys[whole], rows[:, whole]
    return keys, rows


def _count_left(tally: Tally, can_id, rows, slot, table, complete) -> None:
    """Count frames of this epoch that no complete group holds."""
    left = np.zeros(len(can_id), bool)
    left[rows] = True
    for _, group in complete.values():
        left[group] = False
    first = table[slot] == np.arange(len(can_id))
    tally.add(Reason.SURPLUS, can_id, left & ~first)
    tally.add(Reason.INCOMPLETE, can_id, left & first)


def admitted(
    codec: Codec, frames: FrameBatch, session: int, rejected: NDArray[np.int64]
) -> tuple[FrameBatch, NDArray[np.int64], bool]:
    """Frames without stray time marks of another session, the next counts, and whether another session has
    begun: then counters start anew, and the old ones must not keep the new session out.

    It has if the block, read without memory, carries a complete time mark of it and none of this session.
    A stray mark is kept away from the counters too, or it would cost the epochs after it.
    """
    found = node_monitor.strangers(codec, frames, session)
    if found is None:
        return frames, rejected, False
    which, alone = found
    if alone:
        fresh, *_ = intake(codec, frames, e2e.fresh_counters(), rejected)
        if fresh.mark is not None:
            return frames, rejected, True
    tally = Tally(rejected)
    tally.add(Reason.OTHER_SESSION, frames.can_id & SFF_MASK, which)
    return frames[~which], tally.counts, False


def _mark(keys, v, nibble: int) -> Mark | None:
    """The time mark, if its three frames are there, of the epoch they say and of a time that exists."""
    if not len(keys):
        return None
    names = ("session", "epoch", "week", "second", "nanosecond", "leap", "mark_clock")
    session, epoch, week, second, nanosecond, leap, clock = (int(v[name][0]) for name in names)
    if epoch % 16 != nibble:
        return None
    if week > LAST_WEEK or second >= gpstime.S_PER_WEEK or nanosecond >= gpstime.NS_PER_S:
        return None
    return Mark(session, epoch, gpstime.from_week(week, second, nanosecond), leap, clock)


def _attitude(keys, v) -> AttitudeReport | None:
    if not len(keys):
        return None
    q = np.array([v[f"q{i}"][0] for i in range(4)])
    norm = np.sqrt(q @ q)
    # Quantisation leaves the norm within 3e-7 of one; anything else is no attitude.
    if abs(norm - 1) > 1e-4:
        return None
    return AttitudeReport(q / norm, np.array([v[f"w{axis}_rps"][0] for axis in "xyz"]))


def _sat(v) -> NDArray[np.int64]:
    return (v["sat_system"] * NUMBERS + v["sat_number"]).astype(np.int64)


def _measurements(keys, v) -> Measurements:
    return Measurements(
        receiver=keys // CHANNELS,
        channel=keys % CHANNELS,
        sat=_sat(v),
        pseudorange_m=v["pseudorange_m"],
        range_rate_mps=v["range_rate_mps"],
        cn0_dbhz=v["cn0_dbhz"],
        lock=v["lock"],
        health=v["health"],
        ura=v["ura"],
        pos_sv_m=np.array((v["x_m"], v["y_m"], v["z_m"])),
        vel_sv_mps=np.array((v["vx_mps"], v["vy_mps"], v["vz_mps"])),
        clock_m=v["clock_m"],
        clock_drift_mps=v["clock_drift_mps"],
        signal=v["signal"].astype(np.int64),
        frequency=v["frequency"],
    )


def _almanac(keys, v) -> AlmanacRows:
    return AlmanacRows(
        _sat(v),
        np.array((v["x_m"], v["y_m"], v["z_m"])).T,
        np.array((v["vx_mps"], v["vy_mps"], v["vz_mps"])).T,
        v["health"] == 0,
    )


def _acks(keys, v) -> Acks:
    return Acks(
        keys // CHANNELS, keys % CHANNELS, v["result"].astype(int), _sat(v), v["transaction"].astype(int)
    )


def _receivers(keys, v) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Boot counts and clock domains, (MAX_RECEIVERS,) each."""
    both = np.full((2, MAX_RECEIVERS), -1, np.int64)
    both[:, keys] = v["boot_count"], v["clock_domain"]
    return both[0], both[1]
