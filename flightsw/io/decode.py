"""Arrows 2->3, 2->7 and 4->5 of RU 2706636 C1: the frames of an epoch as measurements, attitude, almanac.

Nothing here raises on what a bus may carry. What cannot be used is counted by reason and identifier, with
its consequence. The rules:

- A frame passes `dbc.contract.e2e.screen` (form, CRC, counter) and carries the epoch of the time mark, or
  is rejected.
- Of two frames for one slot of a record in one epoch the first stands.
- A channel counts when all its ten frames are there; a lost frame takes out its own channel, nothing else.
  So a status that announces more frames than came changes nothing: the missing ones have done their harm.
- A node whose heartbeat names another contract is not used at all in that block.
- Without a complete time mark of a time that exists nothing else of the block is used: an epoch without a
  time is no epoch.
- The mark is the last one in the block; if a link merged two blocks, the older epoch's frames are rejected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I8, I32, I64, U8, U64, Index
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e import Verdict
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import CHANNELS, MAX_RECEIVERS
from gnss_hil.flightsw.io import node_monitor
from gnss_hil.flightsw.io.frame_groups import Complete, complete, group_table, rows_by_slot, slots
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections
from gnss_hil.flightsw.records.epoch import (
    NO_ACKS,
    NO_ALMANAC,
    Acks,
    AlmanacRows,
    AttitudeReport,
    Epoch,
    Mark,
    Measurements,
    empty_epoch,
)

LAST_WEEK = np.iinfo(np.int64).max // gpstime.NS_PER_WEEK - 1
"""The last whole week, 15249 (AD 2272), that 64 bits of nanoseconds can hold."""

UNIT_NORM = 1e-4
"""Quantisation leaves the norm of a quaternion within 3e-7 of one; farther off it is no attitude."""


@dataclass(frozen=True, slots=True, eq=False)
class _Block:
    """Screened frames of known groups, (n,) each.

    can_id, slot   identifier and slot
    words          payloads as little-endian words
    nibble         epoch modulo 16
    values         (n, columns) physical values
    """

    can_id: I64
    slot: I64
    words: U64
    nibble: U8
    values: F64


def decode(codec: Codec, frames: FrameBatch, counters: I8, rejected: I64) -> tuple[Epoch, I8, I64]:
    """The epoch in a block of frames.

    counters   receiver state of the protection
    rejected   (REASONS, IDENTIFIERS) counts so far
    returns    the epoch, the next counters, the next counts; arguments are not modified
    """
    screened = e2e.screen(codec, frames, counters)
    counts = Rejections(rejected)
    counts.add(screened.verdict, frames.can_id & SFF_MASK, screened.verdict > Verdict.OK)
    node_monitor.count_silent(codec, screened.frames, counters, counts)
    block = _block(codec, node_monitor.of_our_contract(codec, screened.frames, counts))
    mark_nibble = _nibble_of_mark(codec, block)
    rows = np.flatnonzero(block.nibble == mark_nibble)
    table = group_table(codec)
    filled = rows_by_slot(table, block.slot, rows)
    found = {name: complete(filled, group) for name, group in table.groups.items()}
    mark = _mark(found["mark"], block.values, mark_nibble)
    if mark is None:
        _count_timeless(counts, block, found["mark"])
        return empty_epoch(screened.lost), screened.counters, counts.counts
    if len(rows) < len(block.slot):
        counts.add(Verdict.MIXED_EPOCH, block.can_id, block.nibble != mark_nibble)
    if sum(records.rows.size for records in found.values()) < len(rows):
        _count_unused(counts, block, rows, filled[block.slot], found)
    boots, domains = _receivers(found["receiver"], block.values)
    epoch = Epoch(
        mark=mark,
        attitude=_attitude(found["attitude"], block.values),
        measurements=_measurements(found["measurement"], block.values),
        almanac=_almanac(found["almanac"], block.values),
        acks=_acks(found["ack"], block.values),
        boots=boots,
        domains=domains,
        lost=screened.lost,
    )
    return epoch, screened.counters, counts.counts


def admitted(codec: Codec, frames: FrameBatch, session: int, rejected: I64) -> tuple[FrameBatch, I64, bool]:
    """Frames without stray time marks of another session, the next counts, and whether another session has
    begun: then counters start anew, and the old ones must not keep the new session out.

    It has if the block, read without memory, carries a complete time mark of it and none of this session.
    A stray mark is kept away from the counters too, or it would cost the epochs after it.
    """
    found = node_monitor.other_sessions(codec, frames, session)
    if found is None:
        return frames, rejected, False
    if found.alone:
        fresh, *_ = decode(codec, frames, e2e.fresh_counters(), rejected)
        if fresh.mark is not None:
            return frames, rejected, True
    counts = Rejections(rejected)
    counts.add(Reason.OTHER_SESSION, frames.can_id & SFF_MASK, found.marks)
    return frames[~found.marks], counts.counts, False


def _block(codec: Codec, frames: FrameBatch) -> _Block:
    """Frames of known groups, decoded; the others carry nothing for a flight software."""
    table = group_table(codec)
    known = table.slot_of[frames.can_id] >= 0
    if not known.all():
        frames = frames[known]
    words = np.ascontiguousarray(frames.data).view("<u8")[:, 0]
    can_id = frames.can_id.astype(np.int64)
    values = table.reader.read(frames.can_id, words)
    return _Block(can_id, slots(table, can_id, words), words, frames.data[:, 1] >> np.uint8(4), values)


def _nibble_of_mark(codec: Codec, block: _Block) -> int:
    """Epoch modulo 16 of the last TIME_MARK; -1, which no frame has, without one."""
    opens = np.flatnonzero(block.can_id == codec.can_id_of["TIME_MARK", 0])
    return int(block.nibble[opens[-1]]) if len(opens) else -1


def _count_timeless(counts: Rejections, block: _Block, mark: Complete) -> None:
    """Count all frames of a block without a time: those of the mark itself as bad."""
    bad = np.zeros(len(block.slot), bool)
    bad[mark.rows] = True
    counts.add(Reason.BAD_TIME_MARK, block.can_id, bad)
    counts.add(Reason.NO_TIME_MARK, block.can_id, ~bad)


def _count_unused(
    counts: Rejections, block: _Block, rows: Index, standing: I32, found: dict[str, Complete]
) -> None:
    """Count frames of this epoch that no complete record holds; standing (n,) row that has
    each one's slot."""
    left = np.zeros(len(block.slot), bool)
    left[rows] = True
    for records in found.values():
        left[records.rows] = False
    first = standing == np.arange(len(block.slot))
    counts.add(Reason.SURPLUS, block.can_id, left & ~first)
    counts.add(Reason.INCOMPLETE, block.can_id, left & first)


def _mark(found: Complete, values: F64, nibble: int) -> Mark | None:
    """The time mark, if its three frames are there, of the epoch they name and of a time that exists."""
    if not len(found):
        return None
    v = {name: int(value[0]) for name, value in found.signals(values).items()}
    if v["epoch"] % 16 != nibble:
        return None
    week, second, nanosecond = v["week"], v["second"], v["nanosecond"]
    if week > LAST_WEEK or second >= gpstime.S_PER_WEEK or nanosecond >= gpstime.NS_PER_S:
        return None
    t_ns = gpstime.from_week(week, second, nanosecond)
    return Mark(session=v["session"], epoch=v["epoch"], t_ns=t_ns, leap=v["leap"], clock=v["mark_clock"])


def _attitude(found: Complete, values: F64) -> AttitudeReport | None:
    if not len(found):
        return None
    v = found.signals(values)
    q = np.array([v[f"q{i}"][0] for i in range(4)])
    norm = np.sqrt(q @ q)
    if abs(norm - 1) > UNIT_NORM:
        return None
    return AttitudeReport(q / norm, np.array([v[f"w{axis}_rps"][0] for axis in "xyz"]))


def _sat(v: dict[str, F64]) -> I64:
    return (v["sat_system"] * NUMBERS + v["sat_number"]).astype(np.int64)


def _measurements(found: Complete, values: F64) -> Measurements:
    v = found.signals(values)
    return Measurements(
        receiver=found.key // CHANNELS,
        channel=found.key % CHANNELS,
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


def _almanac(found: Complete, values: F64) -> AlmanacRows:
    if not len(found):
        return NO_ALMANAC
    v = found.signals(values)
    return AlmanacRows(
        sat=_sat(v),
        pos_ecef_m=np.array((v["x_m"], v["y_m"], v["z_m"])).T,
        vel_ecef_mps=np.array((v["vx_mps"], v["vy_mps"], v["vz_mps"])).T,
        healthy=v["health"] == 0,
    )


def _acks(found: Complete, values: F64) -> Acks:
    if not len(found):
        return NO_ACKS
    v = found.signals(values)
    return Acks(
        receiver=found.key // CHANNELS,
        channel=found.key % CHANNELS,
        result=v["result"].astype(np.int64),
        sat=_sat(v),
        transaction=v["transaction"].astype(np.int64),
    )


def _receivers(found: Complete, values: F64) -> tuple[I64, I64]:
    """Boot counts and clock domains, (MAX_RECEIVERS,) each."""
    v = found.signals(values)
    both = np.full((2, MAX_RECEIVERS), -1, np.int64)
    both[:, found.key] = v["boot_count"], v["clock_domain"]
    return both[0], both[1]
