"""The recorder's order: one canonical order of frames per epoch, whichever node was quicker on the bus.

Per epoch: the emulator's block, then each flight node's block, each in sending order. Where the emulator does
not close its blocks with BENCH_SYNC, or the flight software its own with BENCH_DONE, frames at a free pace
stay in the order they were heard. Bench frames steer and are left out; so are time marks that open no epoch,
what came before the first one (start heartbeats), and what comes after BENCH_END but the last answer.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Bench, Refusal
from gnss_hil.dbc.lockstep.slave_protocol import Label
from gnss_hil.tools.decoder.time_marks import marks_in
from gnss_hil.tools.recording.account import Heard
from gnss_hil.tools.recording.flight_blocks import FlightBlocks


@dataclass(frozen=True, slots=True)
class Epoch:
    """All frames of one epoch in canonical order."""

    number: int
    frames: FrameBatch


@dataclass(frozen=True, slots=True)
class _Doubtful:
    """A mark that does not lead on, and where in what was heard it stands."""

    label: Label
    piece: int


class Sequencer:
    """Turns frames as heard into epochs in canonical order.

    The first intact time mark begins the run. Marks are believed as the flight side believes them
    (`gnss_hil.dbc.lockstep.slave_protocol`): one that does not lead on opens an epoch when its own SYNC
    follows, or a mark that leads on from it. Those that nothing bears out are left out and counted. An epoch
    whose mark is lost or late begins behind the SYNC before it. A record is of one run: another on the bus is
    refused, unless the first had not brought an epoch yet.

    session   of the run, None if it is not known beforehand; that it is means that its emulator sends SYNCs
    opened    epochs that began      ended  BENCH_END was heard
    refused   bench frames that were not believed;  refused_in  how many of them in which epoch
    refused_marks  intact time marks that opened no epoch
    flight    what the flight software answered
    """

    def __init__(self, codec: Codec, lockstep: bool, session: int | None = None):
        self._codec = codec
        self._lockstep = lockstep
        self._flight_id = np.zeros(IDENTIFIERS, bool)
        self._flight_id[[i for i, sender in enumerate(codec.sender_of) if sender == "FLIGHT"]] = True
        self._session = session
        self._at: Label | None = None
        self._doubtful: _Doubtful | None = None
        self._heard: list[FrameBatch] = []
        self._block = 0  # pieces heard when SYNC closed the block; what comes then is of the next epoch
        self._announced = -1
        self.flight = FlightBlocks(codec)
        self.opened = self._syncs = 0  # epochs marked, announced
        self.ended = False
        self.refused: Counter[Refusal] = Counter()
        self.refused_in: Counter[int] = Counter()
        self.refused_marks = 0
        self._declared = 0  # by the emulator, in SYNC

    @property
    def declared(self) -> int:
        """Frames that the senders of all blocks declare; 0 if a declaration is missing in any epoch."""
        whole = self.flight.answers == self._syncs >= self.opened
        return self._declared + self.flight.declared if whole else 0

    @property
    def session(self) -> int | None:
        """The run's, as far as it is known."""
        return self._session if self._at is None else self._at.session

    @property
    def answers(self) -> int:
        """Epochs that the flight software closed with DONE."""
        return self.flight.answers

    def account(self, recorded: int) -> Heard:
        """What was counted up to now, so many epochs on record."""
        flight = self.flight
        return Heard(
            recorded, flight.answers, dict(self.refused), self.refused_marks, flight.late, flight.lost,
            ended=self.ended, miscounts=flight.miscounts, miscount=flight.miscount,
            refused_in=dict(self.refused_in),
        )  # fmt: skip

    @property
    def steered(self) -> bool:
        """Whether the emulator closes its blocks with BENCH_SYNC."""
        return self._syncs > 0

    @property
    def answering(self) -> bool:
        """Whether the flight software closes its blocks with BENCH_DONE."""
        return self.flight.answers > 0

    @property
    def unanswered(self) -> int:
        """Epochs that were announced and not answered before the next one began."""
        waiting = self._at is not None and self._announced == self._at.epoch > self.flight.answered
        return self._syncs - self.flight.answers - waiting

    def hear(self, frames: FrameBatch) -> list[Epoch]:
        """Epochs that these frames completed."""
        closed: list[Epoch] = []
        marks = marks_in(self._codec, frames)
        labels = dict(zip(marks.rows.tolist(), map(Label, marks.session.tolist(), marks.epoch.tolist()),
                          strict=True))  # fmt: skip
        begin = 0
        for i in sorted([*labels, *messages.rows(frames)]):
            self._take(frames[begin:i])
            begin = i + 1
            if i in labels:
                closed += self._on_mark(labels[i], frames[i : i + 1])
            else:
                closed += self._on_bench(frames, i)
        self._take(frames[begin:])
        return closed

    def finish(self) -> list[Epoch]:
        """The epoch in hand, closed; with what no BENCH_DONE claimed, unless the run was over."""
        if self._at is None:
            return []
        self._pass_over()
        over = self.ended and self.steered
        return self._close([] if over else self.flight.unclaimed(start=not self.steered), last=True)

    def _on_mark(self, label: Label, mark: FrameBatch) -> list[Epoch]:
        if self.ended or (self._at is None and self._session not in (None, label.session)):
            self.refused_marks += 1
            return []
        if self._at is None or self._leads_on(label):
            self._pass_over()
            early = self._cut_behind_block()
            closed = self._close_for_next()
            self._open(label, [*early, mark])
            return closed
        if self._at == label:
            self.refused_marks += 1
            return []
        if self._borne_out_by(label) and self._believable:
            closed = self._believe() + self._close_for_next()
            self._open(label, [mark])
            return closed
        self._pass_over()
        self._doubtful = _Doubtful(label, len(self._heard))
        self._heard.append(mark)
        return []

    def _cut_behind_block(self) -> list[FrameBatch]:
        """Frames that came behind the SYNC of the epoch at hand, taken out: the next mark is late or lost."""
        if self._at is None or self._announced != self._at.epoch:
            return []
        early, self._heard = self._heard[self._block :], self._heard[: self._block]
        return early

    def _borne_out_by(self, label: Label) -> bool:
        """Whether a mark bears out the one in doubt; a run that is steered waits for its SYNC."""
        steered = self.steered or self._session is not None
        if self._doubtful is None or (steered and label.session == self.session):
            return False
        return self._doubtful.label.leads_to(label)

    def _leads_on(self, label: Label) -> bool:
        """Whether a mark needs nothing more to be believed."""
        assert self._at is not None
        if self.steered or self._session is not None:
            return self._announced == self._at.epoch and self._at.leads_to(label, 1)
        return self._at.leads_to(label)

    def _pass_over(self) -> None:
        """The mark in doubt is borne out by nothing."""
        if self._doubtful is not None:
            del self._heard[self._doubtful.piece]
            self._doubtful = None
            self.refused_marks += 1

    def _believe(self) -> list[Epoch]:
        """The mark in doubt is borne out: the run goes on there, or begins there."""
        doubtful = self._doubtful
        assert doubtful is not None
        onward = self._is_onward(doubtful.label)
        pieces, self._heard = self._heard[doubtful.piece :], self._heard[: doubtful.piece]
        self._doubtful = None
        closed = self._close_for_next() if onward else []
        if not onward:
            self._heard = []
            self.flight.take_closed()
            self.refused_marks += 1
            self.opened -= 1
        self._open(doubtful.label, pieces)
        return closed

    def _is_onward(self, label: Label) -> bool:
        assert self._at is not None
        return label.session == self._at.session and label.epoch > self._at.epoch

    @property
    def _believable(self) -> bool:
        """Whether the mark in doubt is of this run, or of one that began instead of it."""
        assert self._doubtful is not None
        label, barely = self._doubtful.label, self.opened == 1 and not self.steered
        return self._is_onward(label) or (barely and self._session in (None, label.session))

    def _open(self, label: Label, pieces: list[FrameBatch]) -> None:
        if self.opened and not self._syncs:
            self._lockstep = False
        self._at = label
        self.opened += 1
        self._heard = pieces

    def _close_for_next(self) -> list[Epoch]:
        """The open epoch, if there is one; answers that are on their way stay."""
        if self._at is None:
            return []
        tail = []
        if not self.steered:
            tail = self.flight.unclaimed(start=True)
        elif not self._lockstep and not self.answering:
            tail = self.flight.pending
        return self._close(tail, last=False)

    def _close(self, tail: list[FrameBatch], last: bool) -> list[Epoch]:
        assert self._at is not None
        epoch = Epoch(self._at.epoch, concat([*self._heard, *self.flight.take_closed(), *tail]))
        self._heard = []
        if tail or last:
            self.flight.pending = []
        if last:
            self._at = None
        return [epoch]

    def _take(self, frames: FrameBatch) -> None:
        if not len(frames):
            return
        flight = self._flight_id[frames.can_id & SFF_MASK]
        apart = self._lockstep or self.steered
        if apart and flight.any() and self._at is not None:
            self.flight.pending.append(frames[flight])
        if self._at is not None and not self.ended:
            rest = frames[~flight] if apart else frames
            if len(rest):
                self._heard.append(rest)

    def _on_bench(self, frames: FrameBatch, row: int) -> list[Epoch]:
        """What a bench frame says of the run; before the first mark nothing."""
        if self._at is None:
            return []
        ending = int(frames.can_id[row] == messages.END_ID)
        found = messages.judge(frames, row, self._at.session, self._at.epoch + ending)
        if frames.can_id[row] == messages.SYNC_ID and not self.ended:
            return self._on_sync(frames, row, found)
        late = (
            messages.late_answer(frames, row, found, self._at.epoch, self._at.session)
            if isinstance(found, Refusal)
            else None
        )
        if late is not None:
            self.flight.close(late.epoch, late.count, self._at.epoch, self.ended)
        elif isinstance(found, Bench) and found.can_id == messages.END_ID and not self.ended:
            self.ended = True
        elif isinstance(found, Bench) and found.can_id == messages.DONE_ID and found.epoch <= self._announced:
            self.flight.close(found.epoch, found.count, self._at.epoch, self.ended)
        else:
            self._refuse(found)
        return []

    def _on_sync(self, frames: FrameBatch, row: int, found: Bench | Refusal) -> list[Epoch]:
        closed: list[Epoch] = []
        assert self._at is not None
        if not (isinstance(found, Bench) and found.epoch == self._at.epoch):
            own = self._of_doubtful(frames, row)
            if own is not None and self._believable:
                closed, found = self._believe(), own
            elif isinstance(found, Bench) and found.epoch == self._at.epoch + 1 == self._announced + 1:
                self._pass_over()
                early = self._cut_behind_block()  # its mark was lost
                closed = self._close_for_next()
                self._open(Label(found.session, found.epoch), early)
        if not (
            isinstance(found, Bench) and (found.session, found.epoch) == (self._at.session, self._at.epoch)
        ):
            self._refuse(found)
        elif found.epoch > self._announced:
            self._pass_over()
            self._announced, self._block = found.epoch, len(self._heard)
            self._syncs += 1
            self._declared += found.count
        return closed

    def _refuse(self, found: Bench | Refusal) -> None:
        assert self._at is not None
        self.refused[found if isinstance(found, Refusal) else Refusal.OUT_OF_TURN] += 1
        self.refused_in[self._at.epoch] += 1

    def _of_doubtful(self, frames: FrameBatch, row: int) -> Bench | None:
        """The SYNC in a row if it is that of the mark in doubt."""
        if self._doubtful is None:
            return None
        label = self._doubtful.label
        found = messages.judge(frames, row, label.session, label.epoch)
        return found if isinstance(found, Bench) and found.epoch == label.epoch else None
