"""Arrows 2->3, 2->7 and 4->5 of RU 2706636 C1: the frames of an epoch as measurements, attitude, almanac.

Nothing here raises on what a bus may carry. What cannot be used is counted by reason and identifier, with
its consequence. The rules:

- A frame is used as `gnss_hil.flightsw.io.reception` says: by form, CRC, epoch, contract, counter and the
  state of its stream, or is rejected.
- Of two frames for one slot of a record in one epoch the first stands.
- A channel counts when all its ten frames are there; a lost frame takes out its own channel, nothing else.
- A status that counts channels of which nothing came is told and changes nothing: they have done their harm.
- Of ionospheres that differ that stands which most receivers report, of equally many the lowest receiver's.
- A node whose heartbeat names another contract is not used at all in that block.
- Without a complete time mark of a time that exists nothing else of the block is used: an epoch without a
  time is no epoch.
- The mark is the last one in the block; if a link merged two blocks, the older epoch's frames are rejected.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I32, I64, U32, Index
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e_state import Limits, limits
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.flightsw.io import node_monitor
from gnss_hil.flightsw.io.block_layout import block_layout
from gnss_hil.flightsw.io.frame_groups import STATUS, Records, almanac_records, block_plan, group_table
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections
from gnss_hil.flightsw.io.missing_channels import missed
from gnss_hil.flightsw.io.reception import Reception, nothing_received, receive
from gnss_hil.flightsw.records.epoch import (
    NO_ACKS,
    NO_ALMANAC,
    Acks,
    AlmanacRows,
    AttitudeReport,
    Coefficients,
    Epoch,
    Mark,
    Measurements,
    empty_epoch,
)

_AT_ONCE = limits(Protection())
"""Frames of a stream are used from the first."""

LAST_WEEK = np.iinfo(np.int64).max // gpstime.NS_PER_WEEK - 1
"""The last whole week, 15249 (AD 2272), that 64 bits of nanoseconds can hold."""

_NONE_REPORTED = np.full((2, MAX_RECEIVERS), -1, np.int64)

UNIT_NORM = 1e-4
"""Quantisation leaves the norm of a quaternion within 3e-7 of one; farther off it is no attitude."""


def decode(
    codec: Codec, limits: Limits, frames: FrameBatch, before: Reception, rejected: I64
) -> tuple[Epoch, Reception, I64]:
    """The epoch in a block of frames.

    limits     of the streams' state machines
    before     what is kept of the protection
    rejected   (REASONS, IDENTIFIERS) counts so far
    returns    the epoch, what is kept next, the next counts; arguments are not modified
    """
    counts = Rejections(rejected)
    received = receive(codec, limits, frames, before, counts)
    can_id, words = received.frames.can_id, received.frames.words
    plan = block_plan(codec, received.streams)
    values = plan.values(words)
    mark = mark_of(values["mark"], received.epoch)
    if mark is None:
        _count_timeless(codec, counts, can_id, received.streams, plan.records["mark"].rows)
        return empty_epoch(received.lost), received.reception, counts.counts
    almanac, almanac_values, almanac_unused = almanac_records(codec, plan, words, values)
    for unused in (plan.unused, almanac_unused):
        counts.add_rows(Reason.SURPLUS, can_id, unused.surplus)
        counts.add_rows(Reason.INCOMPLETE, can_id, unused.incomplete)
    ionosphere, others = _ionosphere(values["ionosphere"])
    contradicted = plan.records["ionosphere"].rows[:, others].ravel().astype(np.int64)
    counts.add_rows(Reason.CONTRADICTED, can_id, contradicted)
    attitude = _attitude(values["attitude"])
    if attitude is None and values["attitude"].size:
        counts.add(Reason.TURNED, np.array([codec.can_id_of["ATT_Q01", 0]]), np.ones(1, bool))
    receivers = plan.records["receiver"]
    boots, domains, announced = _receivers(receivers, values["receiver"])
    if (announced > plan.accounted).any():
        closing = can_id[receivers.rows[STATUS]]
        counts.add(Reason.INCOMPLETE, closing, missed(codec, frames, receivers.sender, announced))
    epoch = Epoch(
        mark=mark,
        attitude=attitude,
        measurements=_measurements(plan.records["measurement"], values["measurement"]),
        almanac=_almanac(almanac, almanac_values),
        acks=_acks(plan.records["ack"], values["ack"]),
        ionosphere=ionosphere,
        boots=boots,
        domains=domains,
        lost=received.lost,
    )
    return epoch, received.reception, counts.counts


def admitted(codec: Codec, frames: FrameBatch, session: int, rejected: I64) -> tuple[FrameBatch, I64, bool]:
    """Frames without stray time marks of another session, the next counts, and whether another session has
    begun: then counters start anew, and the old ones must not keep the new session out.

    It has if the block, read without memory, carries a complete time mark of it and none of this session.
    A stray mark is kept away from the counters too, or it would cost the epochs after it.
    """
    found = node_monitor.other_sessions(codec, frames, block_layout(codec, frames.can_id), session)
    if found is None:
        return frames, rejected, False
    if found.alone:
        fresh, *_ = decode(codec, _AT_ONCE, frames, nothing_received(codec), rejected)
        if fresh.mark is not None:
            return frames, rejected, True
    counts = Rejections(rejected)
    counts.add(Reason.OTHER_SESSION, frames.can_id & SFF_MASK, found.marks)
    return frames[~found.marks], counts.counts, False


def _count_timeless(codec: Codec, counts: Rejections, can_id: U32, streams: I64, opens: I32) -> None:
    """Count all frames of a block without a time: those of the mark itself, in rows `opens`, as bad. Those of
    no group carry nothing for a flight software."""
    bad = np.zeros(len(can_id), bool)
    bad[opens] = True
    counts.add(Reason.BAD_TIME_MARK, can_id, bad)
    counts.add(Reason.NO_TIME_MARK, can_id, ~bad & (group_table(codec).slot_of[streams] >= 0))


# Signals of the groups in the order of `gnss_hil.flightsw.io.frame_groups`.


def mark_of(values: F64, nibble: int) -> Mark | None:
    """The time mark of signals (7, k), if its frames are there, of the epoch they name, of a time."""
    if not values.size:
        return None
    session, epoch, week, second, nanosecond, leap, clock = map(int, values[:, 0].tolist())
    if epoch % 16 != nibble:
        return None
    if week > LAST_WEEK or second >= gpstime.S_PER_WEEK or nanosecond >= gpstime.NS_PER_S:
        return None
    return Mark(session, epoch, gpstime.from_week(week, second, nanosecond), leap, clock)


def _attitude(values: F64) -> AttitudeReport | None:
    """None if there is none, or a quaternion that is of no length 1."""
    if not values.size:
        return None
    q, rate = values[:4, 0], values[4:, 0]
    norm = np.sqrt(q @ q)
    if abs(norm - 1) > UNIT_NORM:
        return None
    return AttitudeReport(q / norm, rate)


def _sat(system: F64, number: F64) -> I64:
    return (system * NUMBERS + number).astype(np.int64)


def _measurements(found: Records, values: F64) -> Measurements:
    pseudorange, rate, clock, drift, cn0, lock, health, ura, frequency, signal, system, number = values[6:]
    return Measurements(
        receiver=found.sender,
        channel=found.key,
        sat=_sat(system, number),
        pseudorange_m=pseudorange,
        range_rate_mps=rate,
        cn0_dbhz=cn0,
        lock=lock,
        health=health,
        ura=ura,
        pos_sv_m=values[:3],
        vel_sv_mps=values[3:6],
        clock_m=clock,
        clock_drift_mps=drift,
        signal=signal.astype(np.int64),
        frequency=frequency,
    )


def _almanac(found: Records, values: F64) -> AlmanacRows:
    if not len(found):
        return NO_ALMANAC
    health, system, number = values[6:]
    return AlmanacRows(
        sat=_sat(system, number),
        pos_ecef_m=values[:3],
        vel_ecef_mps=values[3:6],
        healthy=health == 0,
    )


def _acks(found: Records, values: F64) -> Acks:
    if not len(found):
        return NO_ACKS
    result, system, number, transaction = values
    return Acks(
        receiver=found.sender,
        channel=found.key,
        result=result.astype(np.int64),
        sat=_sat(system, number),
        transaction=transaction.astype(np.int64),
    )


_NO_OTHERS = np.zeros(0, np.int64)


def _ionosphere(values: F64) -> tuple[Coefficients | None, Index]:
    """By most receivers of those (8, s) that report it, and which (k,) of these say something else. All have
    it from the same satellites: who differs has been told lies, or tells them."""
    if not values.size:
        return None, _NO_OTHERS
    chosen, others = values[:, 0], _NO_OTHERS
    if (values != chosen[:, None]).any():
        alike = (values[:, :, None] == values[:, None, :]).all(axis=0)
        stands = int(alike.sum(axis=0).argmax())
        chosen, others = values[:, stands], np.flatnonzero(~alike[stands])
    return Coefficients(chosen[:4], chosen[4:]), others


def _receivers(found: Records, values: F64) -> tuple[I64, I64, F64]:
    """Boot counts and clock domains, (MAX_RECEIVERS,) each; (n,) frames that those found say they sent."""
    both = _NONE_REPORTED.copy()
    both[:, found.sender] = values[:2]
    return both[0], both[1], values[2]
