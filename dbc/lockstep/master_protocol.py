"""Lockstep, the time master's side of one bus as a state machine, without I/O or clock.

The master opens an epoch with its block and SYNC{session, epoch, count}; each flight node answers with
its block and DONE{session, epoch, count}. A repeated SYNC gets the same answer again.
The flight node's side is `gnss_hil.dbc.lockstep.slave_protocol`; `gnss_hil.dbc.lockstep.master_loop` runs
this one on buses.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec, codec
from gnss_hil.dbc.contract.frames import EMPTY, SFF_MASK, WIDTH, FrameBatch, concat
from gnss_hil.dbc.contract.messages import FLIGHT_NODE, node_names
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Bench, Refusal

FOREIGN = -1

OLDEST_COMMAND = 3
"""Epochs by which a command may be late: docs/contract.md, Commands."""


class Barrier:
    """Nothing flows until every required node was heard with this contract.

    required   node numbers, see `gnss_hil.dbc.contract.messages.node_names`
    greetings  data of each node's heartbeat: copies still under way belong to no epoch
    """

    def __init__(self, codec: Codec, required: Sequence[int] = (FLIGHT_NODE,)):
        self._codec = codec
        self._names = {number: name for name, number in node_names(codec.receivers).items()}
        self._required = tuple(required)
        self._strangers: dict[int, int] = {}
        self._damaged: dict[int, str] = {}
        self.greetings: dict[int, bytes] = {}

    def hear(self, frames: FrameBatch) -> None:
        kind = self._codec.kinds["HEARTBEAT"].number
        frames = frames[frames.can_id <= SFF_MASK]
        frames = frames[self._codec.kind_of[frames.can_id] == kind]
        crc = e2e.crc(frames.can_id, frames.data)
        hashes = self._codec.decode("HEARTBEAT", frames.data)["contract_hash"].tolist()
        for row, number in enumerate(self._codec.number_of[frames.can_id].tolist()):
            length, found = int(frames.length[row]), int(frames.data[row, 0])
            if length != WIDTH:
                self._damaged[number] = f"is of {length} bytes, not {WIDTH}"
            elif found != crc[row]:
                self._damaged[number] = f"is corrupted: CRC {found:02X}, {int(crc[row]):02X} is right"
            elif hashes[row] == self._codec.hash:
                self.greetings[number] = frames.data[row].tobytes()
            else:
                self._strangers[number] = hashes[row]

    @property
    def missing(self) -> tuple[int, ...]:
        return tuple(n for n in self._required if n not in self.greetings)

    @property
    def foreign(self) -> bool:
        """Whether a node that is missing speaks another contract."""
        return any(number in self._strangers for number in self.missing)

    def awaited(self) -> str:
        """The nodes that are missing, as a person calls them."""
        return ", ".join(_CALLED.get(name, name) for name in map(self._name, self.missing))

    def wrong(self) -> str:
        """What is wrong with the heartbeats of missing nodes, for people: "" if none was heard."""
        return "; ".join(self._fault(n) for n in self.missing if n in self._strangers or n in self._damaged)

    def explain(self) -> str:
        """Which nodes are missing, for people: "" if none is."""
        known = [self._fault(n) or f"no heartbeat from {self._name(n)}" for n in self.missing]
        return "; ".join(known)

    def _name(self, number: int) -> str:
        return self._names.get(number, f"node {number}")

    def _fault(self, number: int) -> str:
        name = self._name(number)
        if number in self._strangers:
            spoken, own = self._strangers[number], self._codec
            return (
                f"{name} speaks contract 0x{spoken:08X}{_known_as(spoken, own)}, this bench 0x{own.hash:08X} "
                f"({own.receivers} receivers)"
            )
        return f"the heartbeat of {name} {self._damaged[number]}" if number in self._damaged else ""


_CALLED = {"FLIGHT": "the flight software"}
"""Nodes that have a name besides that in the DBC."""


def _known_as(spoken: int, own: Codec) -> str:
    """What is known of another contract's hash: " (...)", or nothing."""
    swapped = int.from_bytes(own.hash.to_bytes(4, "big"), "little")
    receivers = {codec(n).hash: f" ({n} receivers)" for n in range(1, MAX_RECEIVERS + 1)}
    return " (its bytes in another order)" if spoken == swapped else receivers.get(spoken, "")


@dataclass(frozen=True, slots=True)
class Node:
    """A node that answers in lockstep: the sender's name in the DBC and the identifier of its DONE."""

    sender: str
    done_id: int
    number: int


FLIGHT = Node("FLIGHT", messages.DONE_ID, FLIGHT_NODE)


class Exchange:
    """The time master's side of one bus: opens epochs, collects the answers.

    greetings  data of the heartbeats of nodes that wait, see `Barrier`
    keep_late  free-running: an answer that missed its epoch still counts as heard
    lost       frames that the DONEs announced and that did not arrive
    refused    bench frames that were not believed
    late       answers that came when their epoch was over
    """

    def __init__(
        self,
        codec: Codec,
        session: int,
        greetings: Mapping[int, bytes],
        nodes: Sequence[Node] = (FLIGHT,),
        keep_late: bool = False,
    ):
        self.session = session
        self.lost = self.late = 0
        self.refused: Counter[Refusal] = Counter()
        self._nodes = tuple(nodes)
        self._keep_late = keep_late
        self._greetings = [greetings.get(node.number) for node in nodes]
        self._heartbeat_ids = [codec.can_id_of["HEARTBEAT", node.number] for node in nodes]
        self._node_of = _node_by_identifier(codec, self._nodes)
        self._heard: list[list[FrameBatch]] = [[] for _ in nodes]
        self._foreign: list[FrameBatch] = []
        self._answers: list[FrameBatch | None] = [None for _ in nodes]
        self._answered = [-1 for _ in nodes]
        self._sync = EMPTY
        self._epoch = -1
        self._repeated = False
        self._mixed = False

    def open(self, epoch: int, block: FrameBatch) -> FrameBatch:
        """What to send: the epoch's block, closed by SYNC."""
        self._epoch = epoch
        self._repeated = self._mixed = False
        self._answers = [None for _ in self._nodes]
        count = messages.counted(block)
        self._sync = messages.encode(messages.SYNC_ID, self.session, epoch, min(count, 0xFFFF))
        return concat((block, self._sync))

    def repeat(self) -> FrameBatch:
        """SYNC once more: it, or the answer, may have been lost."""
        self._repeated = True
        return self._sync

    def hear(self, frames: FrameBatch) -> bool:
        """Takes frames in bus order; True once every node has answered this epoch."""
        start = 0
        for row in messages.rows(frames):
            self._keep(frames[start:row])
            start = row + 1
            found = messages.judge(frames, row, self.session, self._epoch)
            late = (
                messages.late_answer(frames, row, found, self._epoch, self.session)
                if isinstance(found, Refusal)
                else None
            )
            if late is not None:
                self._take_late(late)
            elif not isinstance(found, Bench) or not self._closes(found):
                self._refuse(found)
        self._keep(frames[start:])
        return self.answered

    def greeted(self, frames: FrameBatch) -> bool:
        """Whether a node that has not answered yet announces itself in these frames."""
        waiting = [
            can_id
            for can_id, answer in zip(self._heartbeat_ids, self._answers, strict=True)
            if answer is None
        ]
        return bool(np.isin(frames.can_id, waiting).any())

    @property
    def answered(self) -> bool:
        return all(answer is not None for answer in self._answers)

    def inbox(self) -> FrameBatch:
        """The answers in node order, then other nodes' frames; forgets them."""
        frames = concat([a for a in self._answers if a is not None] + self._foreign)
        self._foreign = []
        return frames

    def everything(self) -> FrameBatch:
        """All that was heard, answered or not (free-running paces); forgets it. Of a node that closes its
        answers what is not closed yet waits: only DONE says of which epoch it is."""
        answers = [a for a in self._answers if a is not None]
        waiting = [closed >= 0 for closed in self._answered]
        unfinished = [
            piece for pieces, waits in zip(self._heard, waiting, strict=True) if not waits for piece in pieces
        ]
        self._heard = [pieces if waits else [] for pieces, waits in zip(self._heard, waiting, strict=True)]
        self._foreign, foreign = [], self._foreign
        return concat(answers + unfinished + foreign)

    def end(self, epochs: int, reason: str) -> FrameBatch:
        return messages.encode(messages.END_ID, self.session, epochs, messages.END_REASON[reason])

    def _keep(self, frames: FrameBatch) -> None:
        if not len(frames):
            return
        node = self._node_of[frames.can_id & SFF_MASK]
        if frames.can_id.max() > SFF_MASK:
            node[frames.can_id > SFF_MASK] = FOREIGN
        senders = set(node.tolist())
        for k in senders:
            own = frames if len(senders) == 1 else frames[node == k]
            (self._foreign if k == FOREIGN else self._heard[k]).append(own)

    def _take_late(self, done: Bench) -> None:
        """An answer more than one epoch late. At a pace its commands may count, as long as frames, which
        carry the epoch modulo 16, are sure to be told from those of this epoch."""
        self.late += 1
        self._mixed = True
        k = next((k for k, node in enumerate(self._nodes) if node.done_id == done.can_id), None)
        if self._keep_late and k is not None:
            block = concat(self._heard[k])
            self._heard[k] = []
            self._foreign += [block] if self._epoch - done.epoch <= OLDEST_COMMAND else []

    def _refuse(self, found: Bench | Refusal) -> None:
        """A bench frame that closes nothing. The frames before it may be of an answer to something else: they
        are cut off by the count of the one that is awaited."""
        self.refused[found if isinstance(found, Refusal) else Refusal.OUT_OF_TURN] += 1
        self._mixed = True

    def _closes(self, done: Bench) -> bool:
        """Take a node's DONE of this epoch or of the last one; whether it is one."""
        k = next((k for k, node in enumerate(self._nodes) if node.done_id == done.can_id), None)
        if k is None or done.epoch > self._epoch:
            return False
        block = concat(self._heard[k])
        self._heard[k] = []
        if done.epoch < self._epoch or self._answers[k] is not None:
            # Too late; or the answer to a repeated SYNC, which was taken the first time.
            self.late += self._answered[k] < done.epoch < self._epoch
            self._foreign += [block] if self._keep_late else []
            return True
        surplus = len(block) - done.count
        if surplus > 0:
            cut = self._repeated or self._mixed
            block = block[surplus:] if cut else self._without_greetings(k, block, surplus)
        self.lost += max(0, -surplus)
        self._answers[k], self._answered[k] = block, done.epoch
        return True

    def _without_greetings(self, k: int, block: FrameBatch, surplus: int) -> FrameBatch:
        """Without the heartbeats a waiting node sent before its block; how many were still under way
        depends on wall time and must not reach the emulator."""
        heard = self._greetings[k]
        if heard is None:
            return block
        greeting = np.frombuffer(heard, np.uint8)
        same = (block.can_id == self._heartbeat_ids[k]) & (block.data == greeting).all(axis=1)
        return block[~(same & (np.cumsum(same) <= surplus))]


def _node_by_identifier(codec: Codec, nodes: Sequence[Node]) -> NDArray[np.int8]:
    """(2048,) row of the node that sends an identifier, FOREIGN if none of them does."""
    rows = {node.sender: k for k, node in enumerate(nodes)}
    return np.array([rows.get(codec.sender_of[i], FOREIGN) for i in range(IDENTIFIERS)], np.int8)
