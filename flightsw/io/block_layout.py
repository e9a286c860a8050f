"""What the identifiers of a block of frames decide before a byte of payload is read.

The same nodes send the same kinds of frames in the same order epoch after epoch: what follows from that alone
is worked out once and kept. A block whose identifiers are new costs its look-ups anew, nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import I64, U32
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, WIDTH
from gnss_hil.dbc.contract.messages import FLIGHT_NODE, node_names
from gnss_hil.flightsw.io.frame_groups import MARK

_CLOSING = ("HEARTBEAT", "STATUS", "ATT_RATE", "TIME_FINE")
"""What nodes send once in every epoch, towards its end: each shows that its node is alive."""


@dataclass(frozen=True, slots=True, eq=False)
class Roster:
    """Nodes by identifier, (2048,), 0 for none: who sends it, and the same for closing frames only.
    By node, (k,): its number, its heartbeat's identifier and protected stream."""

    sender: I64
    closing: I64
    node: I64
    beat_id: I64
    beat_stream: I64


@cache
def roster(codec: Codec) -> Roster:
    number = {name: n for name, n in node_names(codec.receivers).items() if n != FLIGHT_NODE}
    sender = np.array([number.get(name, 0) for name in codec.sender_of])
    node = np.array(sorted(number.values()))
    beat_id = np.array([codec.can_id_of["HEARTBEAT", n] for n in node.tolist()])
    closes = np.zeros(IDENTIFIERS, bool)
    closes[[can_id for (kind, _), can_id in codec.can_id_of.items() if kind in _CLOSING]] = True
    stream = codec.key_of(beat_id, np.zeros((len(node), WIDTH), np.uint8))
    return Roster(sender, sender * closes, node, beat_id, stream)


@dataclass(frozen=True, slots=True, eq=False)
class BlockLayout:
    """protection   of the frames, None if not all are protected data frames of the contract
    marks        rows that are TIME_MARKs
    several_marks   more than one frame of a kind that time marks consist of
    beats        rows that are heartbeats
    silent       nodes, by their place in the roster, that close nothing in this block
    """

    protection: e2e.Identifiers | None
    marks: tuple[int, ...]
    several_marks: bool
    beats: tuple[int, ...]
    silent: tuple[int, ...]


def block_layout(codec: Codec, can_id: U32) -> BlockLayout:
    """Of received frames with identifiers (n,), flags among them or not."""
    return _layout(codec, can_id.tobytes())


@lru_cache(maxsize=64)
def _layout(codec: Codec, identifiers: bytes) -> BlockLayout:
    can_id, nodes = np.frombuffer(identifiers, np.uint32), roster(codec)
    heard = set(nodes.closing[can_id[can_id <= SFF_MASK]].tolist())
    beats = set(nodes.beat_id.tolist())
    return BlockLayout(
        protection=e2e.identifiers(codec, can_id) if len(can_id) else None,
        marks=tuple(np.flatnonzero(can_id == codec.can_id_of["TIME_MARK", 0]).tolist()),
        several_marks=any(np.count_nonzero(can_id == codec.can_id_of[kind, 0]) > 1 for kind in MARK),
        beats=tuple(row for row, identifier in enumerate(can_id.tolist()) if identifier in beats),
        silent=tuple(i for i, n in enumerate(nodes.node.tolist()) if n not in heard),
    )
