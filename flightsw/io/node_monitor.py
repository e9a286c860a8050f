"""Which nodes are used: none of another contract, and no stray time mark of another session; a node that
falls silent is counted. An ordinary block costs a few look-ups."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from gnss_hil.dbc.common.arrays import I8, I64, U8, U64, Bool
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.dbc.contract.messages import FLIGHT_NODE, node_names
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections

_CLOSING = ("HEARTBEAT", "STATUS", "ATT_RATE", "TIME_FINE")
"""What nodes send once in every epoch, towards its end: each shows that its node is alive."""


@dataclass(frozen=True, slots=True, eq=False)
class _Roster:
    """Nodes by identifier, (2048,), 0 for none: who sends it, and the same for closing frames and for
    heartbeats only. By node, (k,): its number, its heartbeat's identifier and protected stream."""

    sender: I64
    closing: I64
    beating: I64
    node: I64
    beat_id: I64
    beat_stream: I64


@cache
def _roster(codec: Codec) -> _Roster:
    number = {name: n for name, n in node_names(codec.receivers).items() if n != FLIGHT_NODE}
    sender = np.array([number.get(name, 0) for name in codec.sender_of])
    node = np.array(sorted(number.values()))
    beat_id = np.array([codec.can_id_of["HEARTBEAT", n] for n in node.tolist()])
    closes = np.zeros(IDENTIFIERS, bool)
    closes[[can_id for (kind, _), can_id in codec.can_id_of.items() if kind in _CLOSING]] = True
    beats = np.isin(np.arange(IDENTIFIERS), beat_id)
    stream = codec.key_of(beat_id, np.zeros((len(node), WIDTH), np.uint8))
    return _Roster(sender, sender * closes, sender * beats, node, beat_id, stream)


def _signal(codec: Codec, kind: str, name: str, data: U8) -> U64:
    """(n,) one unscaled signal of frames (n, 8) of one kind."""
    layout = codec.kinds[kind]
    i = layout.signals.index(name)
    return (np.ascontiguousarray(data).view("<u8")[:, 0] >> layout.shift[i]) & layout.mask[i]


def of_our_contract(codec: Codec, frames: FrameBatch, counts: Rejections) -> FrameBatch:
    """Without the frames of nodes whose heartbeat in this block names another contract."""
    roster = _roster(codec)
    beats = np.flatnonzero(roster.beating[frames.can_id])
    other = _signal(codec, "HEARTBEAT", "contract_hash", frames.data[beats]) != codec.hash
    if not other.any():
        return frames
    foreign = np.isin(roster.sender[frames.can_id], roster.sender[frames.can_id[beats[other]]])
    counts.add(Reason.OTHER_CONTRACT, frames.can_id, foreign)
    return frames[~foreign]


def count_silent(codec: Codec, frames: FrameBatch, counters: I8, counts: Rejections) -> None:
    """Count, at their heartbeat's identifier, nodes that close nothing in this block and were heard before;
    `counters` as they were before this block."""
    roster = _roster(codec)
    heard = np.zeros(FLIGHT_NODE, bool)
    heard[roster.closing[frames.can_id]] = True
    silent = ~heard[roster.node] & (counters[roster.beat_stream] >= 0)
    counts.add(Reason.TIMED_OUT, roster.beat_id, silent)


@dataclass(frozen=True, slots=True, eq=False)
class OtherSessions:
    """marks (n,) frames that are intact TIME_MARKs of other sessions; alone: no other mark is intact."""

    marks: Bool
    alone: bool


def other_sessions(codec: Codec, frames: FrameBatch, session: int) -> OtherSessions | None:
    """Intact TIME_MARKs of other sessions than this one; None if there is none: the ordinary case."""
    rows = np.flatnonzero(frames.can_id == codec.can_id_of["TIME_MARK", 0])
    other = _signal(codec, "TIME_MARK", "session", frames.data[rows]) != session
    if not other.any():
        return None
    data = frames.data[rows]
    intact = (frames.length[rows] == WIDTH) & (e2e.crc(frames.can_id[rows], data) == data[:, 0])
    if not (other & intact).any():
        return None
    marks = np.zeros(len(frames), bool)
    marks[rows[other & intact]] = True
    return OtherSessions(marks, not (intact & ~other).any())
