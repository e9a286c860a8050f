"""Who spoke for which node on a bus of ours: what a record is of depends on it."""

from __future__ import annotations

from collections import Counter

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, WIDTH, FrameBatch
from gnss_hil.dbc.contract.messages import KIND_BY_NAME
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.decoder.block import EPOCHS
from gnss_hil.tools.decoder.decoder import HELD_BACK
from gnss_hil.tools.decoder.time_marks import marks_in

_REMEMBERED = 64
"""Changes of the peer that speaks for a node; more make no difference."""


class Speakers:
    """Peers of a bus by the node whose frames they send, in the order in which they began to.

    Only what others may believe counts: intact frames of the contract of an epoch near the open one, and
    bench frames that are believed. What a node says once in an epoch tells whether peers spoke by turns; what
    noise can hit upon at any time (commands, heartbeats: every 256th has a right CRC) does not.
    """

    def __init__(self, codec: Codec):
        self._codec = codec
        names = sorted({*codec.sender_of} - {""})
        self._names = names
        self._node_of = np.array([names.index(name) if name else -1 for name in codec.sender_of])
        self._once = np.zeros(len(codec.sender_of), bool)
        self._once[[i for (kind, _), i in codec.can_id_of.items() if _said_once(kind)]] = True
        self._order: list[list[int]] = [[] for _ in names]
        self._several: set[tuple[int, int]] = set()
        self._epoch = 0  # of the last mark

    def hear(self, peer: int, frames: FrameBatch, session: int | None) -> None:
        """Frames (n,) of a peer; the session of the run, None if it is not known."""
        marks = marks_in(self._codec, frames).epoch
        self._epoch = int(marks[-1]) if len(marks) else self._epoch
        can_id = frames.can_id[self._counts(frames, session)]
        self._several |= {(node, peer) for node in np.unique(self._node_of[can_id]).tolist()}
        for node in np.unique(self._node_of[can_id[self._once[can_id]]]).tolist():
            order = self._order[node]
            if (not order or order[-1] != peer) and len(order) < _REMEMBERED:
                order.append(peer)

    def _counts(self, frames: FrameBatch, session: int | None) -> np.ndarray:
        rows = np.flatnonzero((frames.can_id <= SFF_MASK) & (frames.length == WIDTH))
        rows = rows[self._node_of[frames.can_id[rows]] >= 0]
        behind = (
            self._epoch + 1 - (frames.data[rows, 1] >> 4).astype(np.int64)
        ) % EPOCHS  # the next one's: 0
        rows = rows[behind <= HELD_BACK]
        rows = rows[frames.data[rows, 0] == e2e.crc(frames.can_id[rows], frames.data[rows])]
        steering = messages.is_bench(frames.can_id[rows])
        if not steering.any():
            return rows
        keep = ~steering
        keep[steering] = [self._believed(frames, row, session) for row in rows[steering].tolist()]
        return rows[keep]

    def _believed(self, frames: FrameBatch, row: int, session: int | None) -> bool:
        """Whether a bench frame may be; of an unknown session's the epoch alone is asked."""
        asked = messages.session_in(frames, row) if session is None else session
        expected = self._epoch + int(frames.can_id[row] == messages.END_ID)
        return isinstance(messages.judge(frames, row, asked, expected), messages.Bench)

    @property
    def several(self) -> tuple[str, ...]:
        """Nodes for which more than one peer spoke: one that was started again, or a stranger."""
        nodes = Counter(node for node, _ in self._several)
        return tuple(name for node, name in enumerate(self._names) if nodes[node] > 1)

    @property
    def contested(self) -> tuple[str, ...]:
        """Nodes for which peers spoke by turns: what is on record may be of either."""
        return tuple(
            name for name, order in zip(self._names, self._order, strict=True) if len(order) > len(set(order))
        )


def _said_once(kind: str) -> bool:
    return KIND_BY_NAME[kind].cycle == "epoch" and kind != "HEARTBEAT"
