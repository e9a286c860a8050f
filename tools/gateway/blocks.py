"""What comes from the emulator, cut into epochs, without I/O or clock.

SYNC closes an epoch, from the first on alone. Where an emulator of others sends none it is the next mark, or
silence behind all receivers' STATUS.
"""

from __future__ import annotations

from collections.abc import Iterator

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import Bench
from gnss_hil.tools.gateway.cut import QUIET_S, Held, Label, Piece
from gnss_hil.tools.gateway.one_frame import Reader


class Blocks:
    """The emulator's blocks.

    closed  the last epoch that has passed;  ended  the run's BENCH_END has
    """

    def __init__(self, codec: Codec):
        self.closed: Label | None = None
        self.ended = False
        self._marks = Reader(codec, "TIME_MARK", "session", "epoch")
        self._status_ids = {codec.can_id_of["STATUS", r] for r in range(1, codec.receivers + 1)}
        self._held = Held()
        self._labels: list[Label] = []
        self._statuses: set[int] = set()
        self._synced = False

    def hear(self, frames: FrameBatch, now_s: float) -> Iterator[Piece]:
        """Takes frames in bus order; each piece is to be sent before the next is asked for."""
        marks = self._marks.rows(frames)
        start = 0
        for row in sorted(messages.rows(frames) + marks):
            self._keep(frames[start:row], now_s)
            start = row + 1
            if row in marks:
                yield from self._on_mark(frames, row, now_s)
            else:
                yield from self._on_bench(frames, row, now_s)
        self._keep(frames[start:], now_s)
        if self._held and not self._labels and self.closed is None:  # no run yet
            yield Piece(self._held.take())

    def due_s(self) -> float | None:
        """When silence closes the epoch at hand; None: never."""
        complete = bool(self._labels) and self._statuses >= self._status_ids
        return self._held.last_s + QUIET_S if complete and not self._synced else None

    def expire(self, now_s: float) -> Iterator[Piece]:
        due_s = self.due_s()
        if due_s is not None and now_s >= due_s:
            yield self._close(self._labels[0])

    def rest(self) -> FrameBatch:
        """What waits still."""
        return self._held.take()

    def follow(self, frames: FrameBatch) -> int:
        """For frames that do not wait: notes the run's epochs and its end; how many epochs began."""
        begun = 0
        marks = self._marks.rows(frames)
        for row in sorted(messages.rows(frames) + marks):
            if row not in marks:
                self._end(frames, row)
            elif (label := self._label(frames, row)) is not None:
                begun += label != self.closed
                self.closed = label
        return begun

    def _label(self, frames: FrameBatch, row: int) -> Label | None:
        """What a time mark names; None if it is not whole."""
        named = self._marks.read(frames, row)
        return None if named is None else Label(*named)

    def _keep(self, frames: FrameBatch, now_s: float) -> None:
        self._held.keep(frames, now_s)
        if not self._synced:
            self._statuses |= self._status_ids.intersection(frames.can_id.tolist())

    def _on_mark(self, frames: FrameBatch, row: int, now_s: float) -> Iterator[Piece]:
        label = self._label(frames, row)
        if label is not None:
            if not self._synced and self._labels and label != self._labels[0]:
                yield self._close(self._labels[0])
            self._labels.append(label)
        self._held.keep(frames[row], now_s)

    def _on_bench(self, frames: FrameBatch, row: int, now_s: float) -> Iterator[Piece]:
        frame = frames[row]
        if self._end(frames, row):
            if self._labels:
                yield self._close(self._labels[0])
            yield Piece(concat((self._held.take(), frame)))
        elif frame.can_id[0] != messages.SYNC_ID or (label := self._of_sync(frame)) is None:
            self._held.keep(frame, now_s)  # nobody's; it passes in its place
        elif label == self.closed:
            yield Piece(self._held.take(), closing=frame)
        else:
            self._synced = True
            yield self._close(label, frame)

    def _of_sync(self, frame: FrameBatch) -> Label | None:
        """The epoch that a SYNC closes, or has closed; None if it is believed for none. An epoch whose mark
        was lost is the next."""
        known = self._labels[::-1]
        if self.closed is not None:
            known += [self.closed, Label(self.closed.session, self.closed.epoch + 1)]
        for label in known:
            found = messages.judge(frame, 0, label.session, label.epoch)
            if isinstance(found, Bench) and found.epoch == label.epoch:
                return label
        return None

    def _end(self, frames: FrameBatch, row: int) -> bool:
        """Whether a bench frame ends the run at hand."""
        at = self._labels[-1] if self._labels else self.closed
        if frames.can_id[row] != messages.END_ID or at is None:
            return False
        ends = isinstance(messages.judge(frames, row, at.session, at.epoch + 1), Bench)
        self.ended |= ends
        return ends

    def _close(self, label: Label, *closing: FrameBatch) -> Piece:
        self.closed, self._labels, self._statuses = label, [], set()
        return Piece(self._held.take(), label, concat(closing))
