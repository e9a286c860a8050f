"""Lockstep, the flight node's side as a state machine, without I/O or clock: frames cut into epochs.

`gnss_hil.dbc.lockstep.slave_loop` runs it on a bus.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.lockstep import messages


class Task(Enum):
    """What a flight node has to do next."""

    STEP = "step"
    REPEAT = "repeat"
    END = "end"


@dataclass(frozen=True, slots=True)
class Work:
    """STEP: run `block`, from a fresh state if `fresh`, and send `Slave.answer` of the result.
    REPEAT: send `block`, the last answer, again. END: the run is over."""

    task: Task
    block: FrameBatch = EMPTY
    fresh: bool = False


Label = tuple[int, int]
"""Session and epoch: what names an epoch on the bus."""


class Slave:
    """Cuts what a flight node hears into epochs.

    A time mark with a sound CRC opens a run. From then on SYNC closes an epoch where the time master sends
    them, whatever happened to the frames before it. Without them (another emulator than ours) an epoch
    closes when a later mark arrives or, from the second epoch of a run on, `quiet_s` after the last frame
    if all receivers' STATUS came, at the latest `deadline_s` after the mark. A run's first epoch waits for
    SYNC or a second mark, because only then it is known which it is.

    running  a run began and did not end
    lost     frames that the SYNCs announced and that did not arrive
    """

    def __init__(self, codec: Codec, quiet_s: float = 0.02, deadline_s: float = 0.5):
        self.lost = 0
        layout = codec.kinds["TIME_MARK"]
        fields = [layout.signals.index(name) for name in ("session", "epoch")]
        self._label_fields = [(int(layout.shift[i]), int(layout.mask[i])) for i in fields]
        self._mark_id = codec.can_id_of["TIME_MARK", 0]
        self._status_ids = {codec.can_id_of["STATUS", r] for r in range(1, codec.receivers + 1)}
        self._quiet_s, self._deadline_s = quiet_s, deadline_s
        self.forget()

    def forget(self) -> None:
        """Back to waiting for a run's first mark."""
        self.running = False
        self._fresh = True
        self._synced = False
        self._session = -1
        self._answered: Label | None = None
        self._answer = EMPTY
        self._sync: messages.Bench | None = None
        self._clear()

    def _clear(self) -> None:
        self._heard: list[FrameBatch] = []
        self._mark: Label | None = None
        self._mark_s = self._last_s = 0.0
        self._statuses: set[int] = set()

    def hear(self, frames: FrameBatch, now_s: float) -> Iterator[Work]:
        """Takes frames in bus order; each piece of work must be done before the next is asked for."""
        marks = np.flatnonzero(frames.can_id == self._mark_id).tolist()
        start = 0
        for row in sorted(messages.rows(frames) + marks):
            self._keep(frames[start:row], now_s)
            if frames.can_id[row] == self._mark_id:
                start = row
                yield from self._on_mark(frames[row], now_s)
            else:
                start = row + 1
                yield from self._on_bench(messages.decode(frames, row))
        self._keep(frames[start:], now_s)

    def due_s(self) -> float | None:
        """When `expire` will close the epoch if nothing more is heard; None: never."""
        if self._mark is None or self._synced or self._fresh:
            return None
        deadline_s = self._mark_s + self._deadline_s
        complete = self._statuses >= self._status_ids
        return min(deadline_s, self._last_s + self._quiet_s) if complete else deadline_s

    def expire(self, now_s: float) -> Iterator[Work]:
        """Work that silence brings about."""
        due_s = self.due_s()
        if due_s is not None and now_s >= due_s:
            yield self._step(None)

    def answer(self, block: FrameBatch) -> FrameBatch:
        """What to send after STEP gave `block`: the block, closed by DONE if a SYNC asked for it."""
        if self._sync is None:
            return block
        session, epoch = self._answered = self._sync.session, self._sync.epoch
        done = messages.encode(messages.DONE_ID, session, epoch, min(len(block), 0xFFFF))
        self._answer = concat((block, done))
        return self._answer

    def _keep(self, frames: FrameBatch, now_s: float) -> None:
        if not self.running or not len(frames):
            return
        self._heard.append(frames)
        if not self._synced:
            self._last_s = now_s
            self._statuses |= self._status_ids.intersection(frames.can_id.tolist())

    def _on_mark(self, frame: FrameBatch, now_s: float) -> Iterator[Work]:
        if frame.length[0] != 8 or frame.data[0, 0] != e2e.crc(frame.can_id, frame.data)[0]:
            return  # it names nothing; the flight software will count it
        mark = self._label(int.from_bytes(frame.data.tobytes(), "little"))
        if self._mark is not None:
            if mark[0] == self._mark[0] and mark[1] <= self._mark[1]:
                return  # repeated or replayed: part of the epoch, for the flight software to reject
            yield self._step(None)
        if mark[0] != self._session:
            self.forget()
            self._session = mark[0]
        self.running = True
        self._mark = mark
        self._mark_s = self._last_s = now_s

    def _label(self, word: int) -> Label:
        session, epoch = (word >> shift & mask for shift, mask in self._label_fields)
        return session, epoch

    def _on_bench(self, frame: messages.Bench) -> Iterator[Work]:
        if frame.can_id == messages.END_ID and self.running:
            self.forget()
            yield Work(Task.END)
        elif frame.can_id == messages.SYNC_ID and self.running:
            yield from self._on_sync(frame)

    def _on_sync(self, sync: messages.Bench) -> Iterator[Work]:
        if self._answered is not None and self._answered[0] == sync.session:
            if self._mark is None and sync.epoch == self._answered[1]:
                yield Work(Task.REPEAT, self._answer)
                return
            if self._mark is None and sync.epoch < self._answered[1]:
                return
            # Going back behind a new mark: the emulator started again with the same session.
            self._fresh |= sync.epoch <= self._answered[1]
        self._synced = True
        yield self._step(sync)

    def _step(self, sync: messages.Bench | None) -> Work:
        work = Work(Task.STEP, concat(self._heard), self._fresh)
        if sync is not None:
            self.lost += max(0, sync.count - len(work.block))
        self._sync = sync
        self._fresh = False
        self._clear()
        return work
