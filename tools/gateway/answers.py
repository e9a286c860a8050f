"""What comes from the flight software, cut into epochs, without I/O or clock.

DONE closes an answer. Of a node that knows none it is silence behind NAV_STATUS, or the next epoch.
Heartbeats of a node that waits are no answer and pass as they are.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Bench
from gnss_hil.tools.gateway.cut import QUIET_S, Held, Label, Piece


class Answers:
    """The flight software's answers."""

    def __init__(self, codec: Codec):
        self._nav_id = codec.can_id_of["NAV_STATUS", 0]
        self._heartbeat_id = codec.can_id_of["HEARTBEAT", FLIGHT_NODE]
        self._by_flight = np.array([sender == "FLIGHT" for sender in codec.sender_of])
        self._held = Held()
        self.forget()

    def forget(self) -> None:
        """Another run begins."""
        self._run: Label | None = None
        self._answered = -1
        self._closes = self._answers = self._navigated = False

    def hear(self, frames: FrameBatch, now_s: float) -> Iterator[Piece]:
        """Takes frames in bus order; each piece is to be sent before the next is asked for."""
        if self._run is None:  # heartbeats at the start barrier
            yield Piece(frames)
            return
        start = 0
        for row in messages.rows(frames):
            self._keep(frames[start:row], now_s)
            start = row + 1
            found = messages.judge(frames, row, self._run.session, self._run.epoch)
            if frames.can_id[row] == messages.DONE_ID and isinstance(found, Bench):
                yield from self._on_done(frames[row], found)
            else:
                self._held.keep(frames[row], now_s)  # nobody's; it passes in its place
        self._keep(frames[start:], now_s)

    def next_epoch(self, label: Label) -> Iterator[Piece]:
        """The emulator's next block is about to leave: what answers the last one, if nothing has told."""
        run = self._run
        if run is None or label.session != run.session or label.epoch <= run.epoch:
            yield Piece(self._held.take())
            self.forget()
        elif self._answered < run.epoch and not self._closes:
            yield self._close(run.epoch)
        self._run, self._navigated = label, False

    def due_s(self) -> float | None:
        """When silence sends on what waits; None: never."""
        return self._held.last_s + QUIET_S if self._held and self._complete() else None

    def expire(self, now_s: float) -> Iterator[Piece]:
        due_s = self.due_s()
        if due_s is None or now_s < due_s or self._run is None:
            return
        if self._answers and not self._closes:
            yield self._close(self._run.epoch)
        else:
            yield Piece(self._held.take())

    def rest(self) -> FrameBatch:
        """What waits still."""
        return self._held.take()

    def _complete(self) -> bool:
        """Whether nothing more belongs to what waits, if nothing more comes."""
        if self._closes or not self._answers:
            return self._held.only(self._heartbeat_id)
        return self._navigated and self._run is not None and self._answered < self._run.epoch

    def _keep(self, frames: FrameBatch, now_s: float) -> None:
        self._held.keep(frames, now_s)
        if (frames.can_id == self._nav_id).any():
            self._navigated = self._answers = True

    def _on_done(self, frame: FrameBatch, done: Bench) -> Iterator[Piece]:
        """An answer is complete. What the node sent before it, greetings, is none of it."""
        held = self._held.take()
        own = self._is_flights(held)
        if self._closes and done.epoch == self._answered:
            yield Piece(held[~own], again=True)
            return
        self._closes = True
        before = int(own.sum()) - done.count
        first = int(np.searchsorted(np.cumsum(own), before, "right")) if before > 0 else 0
        yield Piece(held[:first])
        self._held.keep(held[first:], self._held.last_s)
        yield self._close(done.epoch, frame)

    def _close(self, epoch: int, closing: FrameBatch = EMPTY) -> Piece:
        assert self._run is not None
        self._answered, self._navigated = epoch, False
        return Piece(self._held.take(), Label(self._run.session, epoch), closing)

    def _is_flights(self, frames: FrameBatch) -> Bool:
        """(n,) what FLIGHT counts as its answer."""
        return (frames.can_id <= SFF_MASK) & self._by_flight[frames.can_id & SFF_MASK]
