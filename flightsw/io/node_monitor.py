"""Which nodes are used: none of another contract, and no stray time mark of another session; a node that
falls silent is counted. An ordinary block costs a few look-ups."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import I8, U8, Bool
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, WIDTH, FrameBatch
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.io.block_layout import BlockLayout, roster
from gnss_hil.flightsw.io.frame_statistics import Reason, Rejections


def _signal(codec: Codec, kind: str, name: str, frames: FrameBatch, rows: tuple[int, ...]) -> list[int]:
    """One unscaled signal of frames of one kind, in some rows."""
    layout = codec.kinds[kind]
    i = layout.signals.index(name)
    shift, mask = int(layout.shift[i]), int(layout.mask[i])
    return [word >> shift & mask for word in frames.words.take(rows).tolist()]


def of_another_contract(codec: Codec, frames: FrameBatch, verdict: U8, layout: BlockLayout) -> Bool | None:
    """(n,) frames of nodes whose sound heartbeat in this block names another contract; None if there is none,
    the ordinary case.

    verdict   (n,) of the frames so far
    """
    hashes = _signal(codec, "HEARTBEAT", "contract_hash", frames, layout.beats)
    other = [row for row, value in zip(layout.beats, hashes, strict=True) if value != codec.hash]
    other = [row for row in other if verdict[row] == Verdict.OK]
    if not other:
        return None
    sender = roster(codec).sender[frames.can_id & SFF_MASK]
    return np.isin(sender, sender[other])


def count_silent(codec: Codec, layout: BlockLayout, counters: I8, counts: Rejections) -> None:
    """Count, at their heartbeat's identifier, nodes that close nothing in this block and were heard before;
    `counters` as they were before this block."""
    if not layout.silent:
        return
    nodes, silent = roster(codec), list(layout.silent)
    heard_before = counters[nodes.beat_stream[silent]] >= 0
    counts.add(Reason.TIMED_OUT, nodes.beat_id[silent], heard_before)


@dataclass(frozen=True, slots=True, eq=False)
class OtherSessions:
    """marks (n,) frames that are intact TIME_MARKs of other sessions; alone: no other mark is intact."""

    marks: Bool
    alone: bool


def other_sessions(
    codec: Codec, frames: FrameBatch, layout: BlockLayout, session: int
) -> OtherSessions | None:
    """Intact TIME_MARKs of other sessions than this one; None if there is none: the ordinary case."""
    sessions = _signal(codec, "TIME_MARK", "session", frames, layout.marks)
    if all(value == session for value in sessions):
        return None
    rows, other = np.array(layout.marks), np.array(sessions) != session
    data = frames.data[rows]
    intact = (frames.length[rows] == WIDTH) & (e2e.crc(frames.can_id[rows], data) == data[:, 0])
    if not (other & intact).any():
        return None
    marks = np.zeros(len(frames), bool)
    marks[rows[other & intact]] = True
    return OtherSessions(marks, not (intact & ~other).any())
