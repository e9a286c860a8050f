"""Lockstep, the flight node's side as a state machine, without I/O or clock: frames cut into epochs.

`gnss_hil.dbc.lockstep.slave_loop` runs it on a bus.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Bench, Refusal


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


@dataclass(frozen=True, slots=True)
class Label:
    """Session and epoch: what names an epoch on the bus."""

    session: int
    epoch: int

    def leads_to(self, label: Label, most: int = messages.LEAD) -> bool:
        """Whether an epoch may come next: of the same session, and not farther on than `most`."""
        return label.session == self.session and 0 < label.epoch - self.epoch <= most


@dataclass(slots=True)
class _Epoch:
    """What was heard from a mark on; receivers whose STATUS came; times of the mark and of the last frame.

    before  of an epoch that is set aside: how many pieces had been heard when its mark came
    """

    label: Label
    mark_s: float
    last_s: float
    before: int = 0
    heard: list[FrameBatch] = field(default_factory=list)
    statuses: set[int] = field(default_factory=set)


class Slave:
    """Cuts what a flight node hears into epochs.

    The first time mark with a sound CRC opens a run. From then on SYNC closes an epoch where the time master
    sends them, whatever happened to the frames before it. Without them (another emulator than ours) an epoch
    closes when a mark comes that leads on or, from the second epoch of a run on, `quiet_s` after the last
    frame if all receivers' STATUS came, at the latest `deadline_s` after the mark. A run's first epoch waits
    for SYNC or a second mark, because only then it is known which it is.

    A mark that does not lead on from the last one (of another session, back, far ahead; where SYNC closes
    epochs, any but the next, and any in an open one) may be a stray or another run. It is set aside with what
    follows it, and believed when its own SYNC comes, or a mark that leads on from it, before anything of the
    run at hand.

    running  a run began and did not end
    lost     frames that the SYNCs announced and that did not arrive
    refused  bench frames that were not believed;  refused_marks  intact marks that open no epoch, left out
    """

    def __init__(self, codec: Codec, quiet_s: float = 0.02, deadline_s: float = 0.5):
        self.lost = self.refused_marks = 0
        self.refused: Counter[Refusal] = Counter()
        layout = codec.kinds["TIME_MARK"]
        fields = [layout.signals.index(name) for name in ("session", "epoch")]
        self._label_fields = [(int(layout.shift[i]), int(layout.mask[i])) for i in fields]
        self._mark_id = codec.can_id_of["TIME_MARK", 0]
        self._status_ids = {codec.can_id_of["STATUS", r] for r in range(1, codec.receivers + 1)}
        self._quiet_s, self._deadline_s = quiet_s, deadline_s
        self.forget()

    def forget(self) -> None:
        """Back to waiting for a run's first mark."""
        self._last: Label | None = None
        self._open: _Epoch | None = None
        self._doubtful: _Epoch | None = None
        self._between: list[FrameBatch] = []
        self._begin_anew()

    def _begin_anew(self) -> None:
        self._fresh = True
        self._synced = False
        self._answered: Label | None = None
        self._answer = EMPTY
        self._sync: Bench | None = None

    @property
    def running(self) -> bool:
        return self._last is not None

    @property
    def _at_hand(self) -> Label:
        """The last epoch of the run, open or not; there is a run."""
        assert self._last is not None
        return self._last

    def hear(self, frames: FrameBatch, now_s: float) -> Iterator[Work]:
        """Takes frames in bus order; each piece of work must be done before the next is asked for."""
        marks = np.flatnonzero(frames.can_id == self._mark_id).tolist()
        start = 0
        for row in sorted(messages.rows(frames) + marks):
            self._keep(frames[start:row], now_s)
            start = row + 1
            if frames.can_id[row] == self._mark_id:
                yield from self._on_mark(frames[row], now_s)
            else:
                yield from self._on_bench(frames, row)
        self._keep(frames[start:], now_s)

    def due_s(self) -> float | None:
        """When `expire` will close the epoch if nothing more is heard; None: never."""
        if self._open is None or self._synced or self._fresh:
            return None
        deadline_s = self._open.mark_s + self._deadline_s
        complete = self._open.statuses >= self._status_ids
        return min(deadline_s, self._open.last_s + self._quiet_s) if complete else deadline_s

    def expire(self, now_s: float) -> Iterator[Work]:
        """Work that silence brings about."""
        due_s = self.due_s()
        if due_s is not None and now_s >= due_s:
            yield self._step(None)

    def answer(self, block: FrameBatch) -> FrameBatch:
        """What to send after STEP gave `block`: the block, closed by DONE if a SYNC asked for it."""
        if self._sync is None:
            return block
        self._answered = Label(self._sync.session, self._sync.epoch)
        count = min(len(block), 0xFFFF)
        done = messages.encode(messages.DONE_ID, self._sync.session, self._sync.epoch, count)
        self._answer = concat((block, done))
        return self._answer

    def _keep(self, frames: FrameBatch, now_s: float) -> None:
        if not self.running or not len(frames):
            return
        if self._open is None:
            self._between.append(frames)
        for epoch in (self._open, self._doubtful):
            if epoch is not None:
                epoch.heard.append(frames)
                epoch.last_s = now_s
                if not self._synced:
                    epoch.statuses |= self._status_ids.intersection(frames.can_id.tolist())

    def _on_mark(self, frame: FrameBatch, now_s: float) -> Iterator[Work]:
        if frame.length[0] != 8 or frame.data[0, 0] != e2e.crc(frame.can_id, frame.data)[0]:
            self._keep(frame, now_s)  # it names nothing; the flight software will count it
            return
        label = self._label(int.from_bytes(frame.data.tobytes(), "little"))
        marked = _Epoch(label, now_s, now_s, heard=[frame])
        if self._last is None:
            self._take_up(marked)
        elif self._open is not None and label == self._open.label:
            self.refused_marks += 1
        elif self._leads_on(label):
            if self._open is not None:
                yield self._step(None)
            self._take_up(marked)
        elif self._borne_out_by(label):
            yield from self._believe()
            yield self._step(None)
            self._take_up(marked)
        else:
            self._pass_over()
            marked.before = len(self._between if self._open is None else self._open.heard)
            self._doubtful = marked

    def _borne_out_by(self, label: Label) -> bool:
        """Whether a mark bears out the one set aside. Where SYNC closes epochs, the run's own need theirs."""
        doubtful = self._doubtful
        if doubtful is None or (self._synced and label.session == self._at_hand.session):
            return False
        return doubtful.label.leads_to(label)

    def _leads_on(self, label: Label) -> bool:
        """Whether a mark needs nothing more to be believed."""
        if self._synced:
            return self._open is None and self._at_hand.leads_to(label, 1)
        return self._at_hand.leads_to(label)

    def _label(self, word: int) -> Label:
        session, epoch = (word >> shift & mask for shift, mask in self._label_fields)
        return Label(session, epoch)

    def _pass_over(self) -> None:
        """The mark set aside is borne out by nothing: what followed it is of the epoch at hand, it is not."""
        self.refused_marks += self._doubtful is not None
        self._doubtful = None

    def _take_up(self, marked: _Epoch) -> None:
        """Open an epoch; frames heard since the last one wait for it."""
        self._pass_over()
        marked.heard = self._between + marked.heard
        self._open, self._last = marked, marked.label
        self._between = []

    def _believe(self) -> Iterator[Work]:
        """The mark set aside is borne out: the run at hand goes on there, or another one begins."""
        doubtful, last = self._doubtful, self._last
        assert doubtful is not None and last is not None
        if doubtful.label.session != last.session or doubtful.label.epoch <= last.epoch:
            self._begin_anew()
            self._between = []
        elif self._open is not None:  # its SYNC was lost
            self._open.heard = self._open.heard[: doubtful.before]
            yield self._step(None)
        self._between = self._between[: doubtful.before]
        self._doubtful = None
        self._take_up(doubtful)

    def _on_bench(self, frames: FrameBatch, row: int) -> Iterator[Work]:
        last, can_id = self._last, frames.can_id[row]
        if last is None or can_id == messages.DONE_ID:
            return
        expected = last.epoch if self._open is not None and can_id == messages.SYNC_ID else last.epoch + 1
        found = messages.judge(frames, row, last.session, expected)
        if can_id == messages.END_ID and isinstance(found, Bench):
            self.forget()
            yield Work(Task.END)
        elif can_id == messages.SYNC_ID and self._for_doubtful(frames, row, found):
            yield from self._believe()
            at_hand = self._at_hand
            sync = messages.judge(frames, row, at_hand.session, at_hand.epoch)
            assert isinstance(sync, Bench)  # it is why the epoch was believed
            yield self._on_sync(sync)
        elif isinstance(found, Bench) and self._in_turn(found):
            if self._answered == Label(found.session, found.epoch) and self._open is None:
                yield Work(Task.REPEAT, self._answer)
            else:
                yield self._on_sync(found)
        else:
            self.refused[found if isinstance(found, Refusal) else Refusal.OUT_OF_TURN] += 1

    def _for_doubtful(self, frames: FrameBatch, row: int, found: Bench | Refusal) -> bool:
        """Whether a SYNC closes the epoch that was set aside, rather than the one at hand."""
        if self._doubtful is None:
            return False
        label = self._doubtful.label
        own = isinstance(found, Bench) and self._open is not None and found.epoch == self._open.label.epoch
        other = messages.judge(frames, row, label.session, label.epoch)
        return not own and isinstance(other, Bench) and other.epoch == label.epoch

    def _in_turn(self, sync: Bench) -> bool:
        """Whether a SYNC of the run closes the open epoch, or one whose mark was lost, or asks for the last
        answer again."""
        at_hand = self._at_hand.epoch
        if self._open is not None:
            return sync.epoch >= at_hand
        return sync.epoch > at_hand or self._answered == Label(sync.session, sync.epoch)

    def _on_sync(self, sync: Bench) -> Work:
        self._synced = True
        return self._step(sync)

    def _step(self, sync: Bench | None) -> Work:
        heard = self._between if self._open is None else self._open.heard
        work = Work(Task.STEP, concat(heard), self._fresh)
        if sync is not None:
            self.lost += max(0, sync.count - len(work.block))
            self._last = Label(sync.session, sync.epoch)
            self._pass_over()
        self._sync = sync
        self._fresh = False
        self._open, self._between = None, []
        return work
