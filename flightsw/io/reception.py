"""Which frames of a block are used, before any record is made of them. In this order a frame is refused

- by its form and CRC;
- if it is of another epoch than the time mark: the block's last TIME_MARK that is intact and in sequence, or,
  if none is in sequence, the last that is intact. Without one epochs are not compared;
- if its node's heartbeat in this block names another contract;
- by its counter. What was refused before has not moved the counter of its stream;
- if the state machine of its stream says that it is not to be used.

Each block is one check of the state machines. A stream's status is that of the frame that is used; where none
is, the worst of those refused. Silence is a status (NO_NEW_DATA) of streams that are there in every epoch: of
kinds of cycle "epoch" without a key. Answers to commands and slices of the almanac come when there is
something to say, a channel's frames while it tracks: their silence is no status. A frame that a channel has
lost takes it out of the epoch anyway.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from gnss_hil.dbc.common.arrays import I8, I64, U8, Index
from gnss_hil.dbc.contract import e2e, e2e_state, screening
from gnss_hil.dbc.contract.allocation import BENCH_FIRST, BENCH_LAST
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e_state import Limits, Status, StreamStates
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import KIND_BY_NAME
from gnss_hil.dbc.contract.screening import Checked, Verdict
from gnss_hil.flightsw.io import node_monitor
from gnss_hil.flightsw.io.block_layout import BlockLayout, block_layout, roster
from gnss_hil.flightsw.io.frame_statistics import REASONS, Reason, Rejections

MOST_SETTLED = 32
"""Blocks that are remembered: satellites of the almanac come in slices of various sizes."""


@dataclass(frozen=True, slots=True, eq=False)
class Reception:
    """What is kept of the protection from block to block.

    counters   (streams,) last counters received
    states     of the streams' state machines
    settled    blocks, by their protected streams as bytes, that leave all states as they are and are used
               whole if all their frames are in order
    """

    counters: I8
    states: StreamStates
    settled: frozenset[bytes] = frozenset()


def nothing_received(codec: Codec) -> Reception:
    return Reception(e2e.fresh_counters(codec), e2e_state.no_data(codec.streams))


@dataclass(frozen=True, slots=True, eq=False)
class Received:
    """Frames of a block that are used.

    streams     (n,) protected ones of the frames
    epoch       modulo 16, of the time mark and of all the frames; -1 without an intact TIME_MARK
    lost        frames missing before them, by the counters
    reception   after this block
    """

    frames: FrameBatch
    streams: I64
    epoch: int
    lost: int
    reception: Reception


def receive(
    codec: Codec, limits: Limits, frames: FrameBatch, before: Reception, counts: Rejections
) -> Received:
    """The frames of a block that are used; all others are counted."""
    layout = block_layout(codec, frames.can_id)
    checked = screening.checked(codec, frames, layout.protection)
    epoch = _epoch_of_mark(frames, checked, layout.marks, before.counters)
    checked = _of_our_epoch_and_contract(codec, frames, checked, layout, epoch)
    screened = screening.sequenced(frames, checked, before.counters)
    verdict, in_order = screened.verdict, screened.streams is not None
    if screened.lost or not in_order:
        counts.add(verdict, frames.can_id & SFF_MASK, verdict > Verdict.OK)
        heard = (verdict <= Verdict.LOST) | (verdict == Reason.OTHER_CONTRACT)
        layout = block_layout(codec, frames.can_id[heard])
    node_monitor.count_silent(codec, layout, before.counters, counts)

    these = checked.streams.tobytes()
    if in_order and these in before.settled:
        after = Reception(screened.counters, before.states, before.settled)
        return Received(frames, checked.streams, epoch, screened.lost, after)
    formed = verdict if checked.rows is None else verdict[checked.rows]
    accepted, streams = screened.frames, checked.streams[formed <= Verdict.LOST]
    states = e2e_state.advance(limits, before.states, _statuses(codec, checked.streams, formed))
    usable = limits.usable.take(states.state.take(streams))
    if not usable.all():
        counts.add(Reason.STREAM_NOT_VALID, accepted.can_id, ~usable)
        accepted, streams, in_order = accepted[usable], streams[usable], False
    settled: frozenset[bytes] = frozenset()
    if states is before.states:
        settled = before.settled if len(before.settled) < MOST_SETTLED else settled
        settled |= {these} if in_order else set()
    return Received(accepted, streams, epoch, screened.lost, Reception(screened.counters, states, settled))


def _epoch_of_mark(frames: FrameBatch, checked: Checked, marks: tuple[int, ...], counters: I8) -> int:
    """Of the frames' time mark, modulo 16; -1 without an intact TIME_MARK."""
    intact = list(marks) if checked.sound else [row for row in marks if checked.verdict[row] == Verdict.OK]
    if not intact:
        return -1
    if len(intact) > 1:
        # Of several, one that is late or comes again does not name the epoch. In a block of several every
        # frame of this stream has its own verdict, whatever its epoch.
        alone = checked.streams[_places(checked, intact)]
        sound = Checked(np.zeros(len(intact), np.uint8), True, None, alone)
        found = screening.sequenced(frames[intact], sound, counters)
        follow = np.flatnonzero(found.verdict <= Verdict.LOST)
        intact = [intact[k] for k in follow] or intact
    return frames.data.item(intact[-1], 1) >> 4


def _places(checked: Checked, rows: list[int]) -> Index:
    """Of well-formed rows of a block, among its well-formed ones."""
    return np.array(rows) if checked.rows is None else np.searchsorted(checked.rows, rows)


def _of_our_epoch_and_contract(
    codec: Codec, frames: FrameBatch, checked: Checked, layout: BlockLayout, epoch: int
) -> Checked:
    """With the verdicts of intact frames that another epoch or another contract has sent."""
    strange = frames.data[:, 1] >> np.uint8(4) != epoch
    if epoch >= 0 and strange.any():
        checked = checked.refusing(strange, Verdict.MIXED_EPOCH)
    foreign = node_monitor.of_another_contract(codec, frames, checked.verdict, layout)
    return checked if foreign is None else checked.refusing(foreign, Reason.OTHER_CONTRACT)


@cache
def _always_there(codec: Codec) -> I64:
    """(k,) protected streams that other nodes send in every epoch."""
    sent = roster(codec).sender
    return np.array(
        [
            codec.first_stream_of[can_id]
            for (name, _), can_id in codec.can_id_of.items()
            if (kind := KIND_BY_NAME.get(name)) is not None
            and (kind.cycle, kind.key) == ("epoch", "")
            and sent[can_id]
            and not BENCH_FIRST <= can_id <= BENCH_LAST
        ],
        np.int64,
    )


def _frame_statuses() -> U8:
    table = np.full(REASONS, Status.NOT_AVAILABLE, np.uint8)
    table[list(e2e_state.STATUS_OF)] = list(e2e_state.STATUS_OF.values())
    table[Reason.OTHER_CONTRACT] = Status.ERROR  # sound, but not data of this stream
    return table


_STATUS_OF = _frame_statuses()
_NOT_AVAILABLE, _NO_NEW_DATA = np.uint8(Status.NOT_AVAILABLE), np.uint8(Status.NO_NEW_DATA)
_WORST_LAST = tuple(map(int, (Status.REPEATED, Status.WRONG_SEQUENCE, Status.ERROR, Status.OK)))
"""One that is used stands for its stream; of those refused the worst."""


def _statuses(codec: Codec, streams: I64, verdict: U8) -> U8:
    """(all streams,) status of this epoch, from frames (n,) and their verdicts."""
    status = np.full(codec.streams, _NOT_AVAILABLE)
    status[_always_there(codec)] = _NO_NEW_DATA
    of_frames = _STATUS_OF.take(verdict)
    if not of_frames.any():
        status[streams] = 0  # OK
        return status
    for each in _WORST_LAST:
        status[streams[of_frames == each]] = each
    return status
