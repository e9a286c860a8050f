"""Arrows 2->3, 2->7 and 4->5 of RU 2706636 C1: the frames of an epoch as measurements, attitude, almanac.

Nothing here raises on what a bus may carry. What cannot be used is counted by reason and identifier, with
its consequence. The rules:

- A frame passes `dbc.e2e.screen` (form, CRC, counter) and carries the epoch of the time mark, or is rejected.
- Of two frames that say the same thing in one epoch the first stands.
- A channel counts when all its ten frames are there; a lost frame takes out its own channel, nothing else.
- Without a complete time mark nothing else of the block is used: an epoch without a time is no epoch.
- The mark is the last one in the block; if a link merged two blocks, the older epoch's frames are rejected.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dbc import e2e, gpstime
from dbc.codec import IDENTIFIERS, Codec
from dbc.contract import CHANNELS, MAX_RECEIVERS, MEASUREMENT_KINDS
from dbc.e2e import Verdict
from dbc.frames import SFF_MASK, FrameBatch
from dbc.satellites import NUMBERS, SATELLITES
from flightsw.wire import Sheet, sheet


class Reason(IntEnum):
    """Why a frame that passed protection is not used; numbered on from `dbc.e2e.Verdict`."""

    NO_TIME_MARK = 16
    SURPLUS = 17
    INCOMPLETE = 18


REASONS = 19

CONSEQUENCE: dict[int, str] = {
    **e2e.CONSEQUENCE,
    Reason.NO_TIME_MARK: "frame ignored, the epoch has no time",
    Reason.SURPLUS: "frame ignored, the first of this epoch stands",
    Reason.INCOMPLETE: "frame ignored, the others of its group are missing",
}


@dataclass(frozen=True, slots=True)
class Mark:
    """The time mark: when all receivers latched."""

    session: int
    epoch: int
    t_ns: int
    leap: int


@dataclass(frozen=True, slots=True)
class AttitudeReport:
    """Attitude at the time mark.

    quaternion_body_from_ecef   (4,) scalar first, Hamilton, passive, normalised
    rate_body_rps               (3,) relative to inertial space
    """

    quaternion_body_from_ecef: NDArray[np.float64]
    rate_body_rps: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Measurements:
    """Complete channels of an epoch, one row each, ordered by receiver and channel.

    receiver, channel, sat   (n,) int: 0-based receiver (= antenna), channel, satellite index
    pseudorange_m            (n,) raw clocks, at the antenna's phase centre
    range_rate_mps           (n,) dP/dt by GPS time
    cn0_dbhz, lock, health, ura   (n,)
    pos_sv_m, vel_sv_mps     (3, n) ECEF of the transmission instant
    clock_m, clock_drift_mps (n,) satellite clock, to be added to the pseudorange, and its rate
    """

    receiver: NDArray[np.int64]
    channel: NDArray[np.int64]
    sat: NDArray[np.int64]
    pseudorange_m: NDArray[np.float64]
    range_rate_mps: NDArray[np.float64]
    cn0_dbhz: NDArray[np.float64]
    lock: NDArray[np.float64]
    health: NDArray[np.float64]
    ura: NDArray[np.float64]
    pos_sv_m: NDArray[np.float64]
    vel_sv_mps: NDArray[np.float64]
    clock_m: NDArray[np.float64]
    clock_drift_mps: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.sat)

    def __getitem__(self, rows) -> Measurements:
        return Measurements(*(getattr(self, name)[..., rows] for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class AlmanacRows:
    """Predictions of this epoch: sat (n,), pos_ecef_m and vel_ecef_mps (n, 3), healthy (n,) bool."""

    sat: NDArray[np.int64]
    pos_ecef_m: NDArray[np.float64]
    vel_ecef_mps: NDArray[np.float64]
    healthy: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Acks:
    """Answers to commands: receiver, channel, result, sat, transaction, each (n,) int."""

    receiver: NDArray[np.int64]
    channel: NDArray[np.int64]
    result: NDArray[np.int64]
    sat: NDArray[np.int64]
    transaction: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Epoch:
    """All that a block of frames says.

    boots       (MAX_RECEIVERS,) boot count of each receiver's heartbeat, -1 where none came
    domains     (MAX_RECEIVERS,) clock domain each receiver's tag names, -1 where none came
    lost        frames missing by the counters
    """

    mark: Mark | None
    attitude: AttitudeReport | None
    measurements: Measurements
    almanac: AlmanacRows
    acks: Acks
    boots: NDArray[np.int64]
    domains: NDArray[np.int64]
    lost: int


@dataclass(frozen=True, slots=True)
class Group:
    """A sheet's place in the slot table: `keys` groups of len(kinds) frames from `base` on."""

    sheet: Sheet
    base: int
    keys: int


@dataclass(frozen=True, slots=True)
class Plan:
    """Where each identifier's frames go. A frame's slot is base + key * step, key = (word >> 16) & mask:
    the channel, or the 9 bits of satellite system and number; every kind that needs a key begins with it."""

    groups: dict[str, Group]
    slots: int
    base_of: NDArray[np.int64]
    step_of: NDArray[np.int64]
    mask_of: NDArray[np.uint64]


_GROUPS: dict[str, tuple[tuple[str, ...], int]] = {
    # name: (kinds, keys of one sender)
    "mark": (("TIME_MARK", "TIME_GPS", "TIME_FINE"), 1),
    "attitude": (("ATT_Q01", "ATT_Q23", "ATT_RATE"), 1),
    "measurement": (MEASUREMENT_KINDS, CHANNELS),
    "almanac": (("ALM_XY", "ALM_Z", "ALM_V"), SATELLITES),
    "ack": (("ACK",), CHANNELS),
    "tag": (("TAG",), 1),
    "heartbeat": (("HEARTBEAT",), 1),
}


@cache
def plan(codec: Codec) -> Plan:
    base_of = np.full(IDENTIFIERS, -1, np.int64)
    step_of = np.zeros(IDENTIFIERS, np.int64)
    mask_of = np.zeros(IDENTIFIERS, np.uint64)
    groups, base = {}, 0
    for name, (kinds, keys) in _GROUPS.items():
        numbers = sorted({number for kind, number in codec.can_id_of if kind == kinds[0]})
        for position, kind in enumerate(kinds):
            for number in numbers:
                if name == "heartbeat" and number > MAX_RECEIVERS:
                    continue
                can_id = codec.can_id_of[kind, number]
                base_of[can_id] = base + max(number - 1, 0) * keys * len(kinds) + position
                step_of[can_id] = len(kinds)
                mask_of[can_id] = keys - 1
        count = keys * (MAX_RECEIVERS if numbers != [0] else 1)
        drop = () if name == "ack" else ("channel",)
        groups[name] = Group(sheet(codec, kinds, drop), base, count)
        base += count * len(kinds)
    return Plan(groups, base, base_of, step_of, mask_of)


def intake(
    codec: Codec, frames: FrameBatch, counters: NDArray[np.int8], rejected: NDArray[np.int64]
) -> tuple[Epoch, NDArray[np.int8], NDArray[np.int64]]:
    """The epoch in a block of frames.

    counters   receiver state of the protection
    rejected   (REASONS, IDENTIFIERS) counts so far
    returns    the epoch, the next counters, the next counts; arguments are not modified
    """
    screened = e2e.screen(codec, frames, counters)
    tally = _Tally(rejected)
    tally.add(screened.verdict, frames.can_id & SFF_MASK, screened.verdict > Verdict.OK)
    good = screened.frames
    can_id = good.can_id
    where = plan(codec)
    base = where.base_of[can_id]
    words = np.ascontiguousarray(good.data).view("<u8")[:, 0]
    nibble = good.data[:, 1] >> 4

    mark, mark_nibble = _mark(codec, where, words, nibble, can_id)
    if mark is None:
        tally.add(Reason.NO_TIME_MARK, can_id, base >= 0)
        return nothing(screened.lost), screened.counters, tally.counts
    ours = (base >= 0) & (nibble == mark_nibble)
    if not ours.all():
        tally.add(Verdict.MIXED_EPOCH, can_id, (base >= 0) & ~ours)

    # Written backwards, so that of two frames with one slot the first stands.
    slot = base + ((words >> np.uint64(16)) & where.mask_of[can_id]).astype(np.int64) * where.step_of[can_id]
    rows = np.flatnonzero(ours)[::-1]
    table = np.full(where.slots, -1, np.int32)
    table[slot[rows]] = rows
    used = np.zeros(len(good), bool)

    def read(name: str):
        group = where.groups[name]
        width = len(group.sheet.kinds)
        rows = table[group.base : group.base + group.keys * width].reshape(group.keys, width)
        keys = np.flatnonzero((rows >= 0).all(axis=1))
        rows = rows[keys]
        used[rows] = True
        return keys, group.sheet.read(words[rows])

    read("mark")
    epoch = Epoch(
        mark,
        _attitude(*read("attitude")),
        _measurements(*read("measurement")),
        _almanac(*read("almanac")),
        _acks(*read("ack")),
        _by_receiver(*read("heartbeat"), "boot_count"),
        _by_receiver(*read("tag"), "clock_domain"),
        screened.lost,
    )
    left = ours & ~used
    if left.any():
        surplus = table[slot] != np.arange(len(good))
        tally.add(Reason.SURPLUS, can_id, left & surplus)
        tally.add(Reason.INCOMPLETE, can_id, left & ~surplus)
    return epoch, screened.counters, tally.counts


class _Tally:
    """Counts by reason and identifier, copied only when something is added."""

    def __init__(self, counts: NDArray[np.int64]):
        self.counts, self._mine = counts, False

    def add(self, reason, can_id: NDArray, which: NDArray[np.bool_]) -> None:
        if not which.any():
            return
        if not self._mine:
            self.counts, self._mine = self.counts.copy(), True
        reasons = np.broadcast_to(np.asarray(reason, np.int64), which.shape)
        np.add.at(self.counts, (reasons[which], can_id[which]), 1)


def no_rejections() -> NDArray[np.int64]:
    return np.zeros((REASONS, IDENTIFIERS), np.int64)


def rejection_table(codec: Codec, rejected: NDArray[np.int64]) -> list[tuple[str, str, int, str]]:
    """Rows (reason, where: identifier and sender, how many, consequence) of all that was counted."""
    name = {**{v.value: v.name for v in Verdict}, **{r.value: r.name for r in Reason}}
    return [
        (
            name[int(reason)],
            f"0x{int(can_id):03X} {codec.sender_of[can_id]}".rstrip(),
            int(rejected[reason, can_id]),
            CONSEQUENCE[int(reason)],
        )
        for reason, can_id in np.argwhere(rejected)
    ]


def session_of(codec: Codec, frames: FrameBatch) -> int | None:
    """Session of the last intact TIME_MARK, whatever its counter: after a restart of the sender counters
    start anew, and the old ones must not keep the new session out."""
    mark_id = codec.can_id_of["TIME_MARK", 0]
    rows = np.flatnonzero((frames.can_id == mark_id) & (frames.length == 8))
    for row in rows[::-1]:
        data = frames.data[row : row + 1]
        if e2e.crc(frames.can_id[row : row + 1], data)[0] == data[0, 0]:
            return int(plan(codec).groups["mark"].sheet.read(np.repeat(data.view("<u8"), 3, 1))["session"][0])
    return None


def _mark(codec, where, words, nibble, can_id) -> tuple[Mark | None, int]:
    """The last complete time mark of the block and its epoch nibble."""
    group = where.groups["mark"]
    last = [np.flatnonzero(can_id == codec.can_id_of[kind, 0]) for kind in group.sheet.kinds]
    if not len(last[0]):
        return None, -1
    epoch_nibble = nibble[last[0][-1]]
    last = [rows[nibble[rows] == epoch_nibble] for rows in last]
    if not all(len(rows) for rows in last):
        return None, -1
    v = group.sheet.read(words[np.array([[rows[0] for rows in last]])])
    session, epoch, week, second, ns, leap = (
        int(v[name][0]) for name in ("session", "epoch", "week", "second", "nanosecond", "leap")
    )
    if epoch % 16 != epoch_nibble:
        return None, -1
    return Mark(session, epoch, gpstime.from_week(week, second, ns), leap), int(epoch_nibble)


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
        keys // CHANNELS,
        keys % CHANNELS,
        _sat(v),
        v["pseudorange_m"],
        v["range_rate_mps"],
        v["cn0_dbhz"],
        v["lock"],
        v["health"],
        v["ura"],
        np.array((v["x_m"], v["y_m"], v["z_m"])),
        np.array((v["vx_mps"], v["vy_mps"], v["vz_mps"])),
        v["clock_m"],
        v["clock_drift_mps"],
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


def _by_receiver(keys, v, name: str) -> NDArray[np.int64]:
    values = np.full(MAX_RECEIVERS, -1, np.int64)
    values[keys] = v[name]
    return values


def nothing(lost: int = 0) -> Epoch:
    """An epoch without a time mark: nothing in it is used."""
    none, nowhere = np.zeros(0), np.zeros(0, np.int64)
    three = np.zeros((3, 0))
    silent = np.full(MAX_RECEIVERS, -1, np.int64)
    return Epoch(
        None,
        None,
        Measurements(nowhere, nowhere, nowhere, none, none, none, none, none, none, three, three, none, none),
        AlmanacRows(nowhere, three.T, three.T, none > 0),
        Acks(nowhere, nowhere, nowhere, nowhere, nowhere),
        silent,
        silent,
        lost,
    )
