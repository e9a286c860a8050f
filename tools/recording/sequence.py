"""The recorder's order: one canonical order of frames per epoch, whichever node was quicker on the bus.

Per epoch: the emulator's block, then each flight node's block, each in sending order (lockstep). At other
paces frames stay in the order they were heard. Bench frames steer and are left out; so is whatever came
before the first time mark (start heartbeats) or after BENCH_END.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Refusal
from gnss_hil.tools.decoder.time_marks import marks_in

_FARTHEST = 10_000
"""Epochs by which a mark may be ahead of the last one. A listener that misses more has left."""


@dataclass(frozen=True, slots=True)
class Epoch:
    """All frames of one epoch in canonical order."""

    number: int
    frames: FrameBatch


class Sequencer:
    """Turns frames as heard into epochs in canonical order.

    The first time mark with a sound CRC begins the run, later ones of its session each open an epoch if they
    lead on. Any other mark is a frame of the epoch it is heard in, for the digest to reject.

    A flight block ends with BENCH_DONE{epoch, count}: the last `count` frames of that node before it. An
    epoch answered twice (its BENCH_SYNC was repeated) counts once, wherever the second answer arrives.

    Where a second mark comes without a BENCH_SYNC before it, the emulator does not steer: from then on frames
    stay in the order they were heard.

    opened   epochs that began      ended  BENCH_END was heard
    refused  bench frames that were not believed
    """

    def __init__(self, codec: Codec, lockstep: bool):
        self._codec = codec
        self._lockstep = lockstep
        self._flight_id = np.zeros(IDENTIFIERS, bool)
        self._flight_id[[i for i, sender in enumerate(codec.sender_of) if sender == "FLIGHT"]] = True
        self._heartbeat = codec.kinds["HEARTBEAT"].number
        self._session = -1
        self._epoch: int | None = None
        self._heard: list[FrameBatch] = []
        self._answers: list[FrameBatch] = []
        self._pending: list[FrameBatch] = []
        self._answered = -1
        self._announced = -1
        self.opened = self._syncs = self._dones = 0  # epochs marked, announced, answered
        self.ended = False
        self.refused: Counter[Refusal] = Counter()
        self._declared = 0

    @property
    def declared(self) -> int:
        """Frames that the senders of all blocks declare; 0 if a declaration is missing in any epoch."""
        return self._declared if self._dones == self._syncs >= self.opened else 0

    @property
    def steered(self) -> bool:
        """Whether the emulator closes its blocks with BENCH_SYNC."""
        return self._syncs > 0

    @property
    def unanswered(self) -> int:
        """Epochs that were announced and not answered before the next one began."""
        waiting = self._epoch is not None and self._announced == self._epoch > self._answered
        return self._syncs - self._dones - waiting

    def hear(self, frames: FrameBatch) -> list[Epoch]:
        """Epochs that these frames completed."""
        closed: list[Epoch] = []
        marks = marks_in(self._codec, frames)
        labels = dict(zip(marks.rows.tolist(), zip(marks.session.tolist(), marks.epoch.tolist(), strict=True),
                          strict=True))  # fmt: skip
        begin = 0
        for i in sorted([*labels, *messages.rows(frames)]):
            if i not in labels:
                self._take(frames[begin:i])
                self._steer(frames, i)
                begin = i + 1
            elif self._opens(*labels[i]):
                self._take(frames[begin:i])
                closed += self.finish(keep_pending=self.steered)
                self._open(*labels[i], frames[i : i + 1])
                begin = i + 1
        self._take(frames[begin:])
        return closed

    def _opens(self, session: int, epoch: int) -> bool:
        """Whether an epoch begins at an intact mark: it leads on from the last one."""
        if self.ended:
            return False
        return self._epoch is None or (session == self._session and 0 < epoch - self._epoch <= _FARTHEST)

    def _open(self, session: int, epoch: int, mark: FrameBatch) -> None:
        if self.opened and not self._syncs:
            self._lockstep = False
        self._session, self._epoch = session, epoch
        self.opened += 1
        self._heard.append(mark)

    def finish(self, keep_pending: bool = False) -> list[Epoch]:
        """The epoch in hand, closed; at the end of the run also what no BENCH_DONE claimed."""
        if self._epoch is None:
            return []
        tail = [] if keep_pending else self._pending
        if not self.steered:  # start heartbeats waited with the first answers
            tail = [self._without_heartbeats(piece) for piece in tail]
        epoch = Epoch(self._epoch, concat([*self._heard, *self._answers, *tail]))
        self._heard, self._answers = [], []
        if not keep_pending:
            self._pending, self._epoch = [], None
        return [epoch]

    def _take(self, frames: FrameBatch) -> None:
        if not len(frames) or self.ended:
            return
        flight = self._flight_id[frames.can_id & SFF_MASK]
        if not self._lockstep:
            if self._epoch is not None:
                self._heard.append(frames)
            return
        if flight.any():
            self._pending.append(frames[flight])
        if self._epoch is not None and not flight.all():
            self._heard.append(frames[~flight])

    def _steer(self, frames: FrameBatch, row: int) -> None:
        """What a bench frame says of the run; before the first mark and behind the end nothing."""
        if self._epoch is None or self.ended:
            return
        ending = frames.can_id[row] == messages.END_ID
        found = messages.judge(frames, row, self._session, self._epoch + ending)
        if isinstance(found, Refusal):
            self.refused[found] += 1
        elif found.can_id == messages.END_ID:
            self.ended = True
        elif found.epoch > self._epoch:  # its mark was lost
            self.refused[Refusal.OUT_OF_TURN] += 1
        elif found.can_id == messages.DONE_ID:
            self._close_answer(found.epoch, found.count)
        elif found.epoch > self._announced:
            self._announced = found.epoch
            self._syncs += 1
            self._declared += found.count

    def _close_answer(self, epoch: int, count: int) -> None:
        first = self._answered < 0
        if epoch > self._answered:
            self._dones += 1
            self._declared += count
        if self._lockstep:
            block = concat(self._pending)
            self._pending = []
            before, block = block[: len(block) - count], block[max(len(block) - count, 0) :]
            if first:  # start heartbeats that crossed the first time mark
                before = self._without_heartbeats(before)
            self._answers.append(before)
            if epoch > self._answered:
                self._answers.append(block)
        self._answered = max(self._answered, epoch)

    def _without_heartbeats(self, frames: FrameBatch) -> FrameBatch:
        return frames[self._codec.kind_of[frames.can_id & SFF_MASK] != self._heartbeat]
