"""What crosses between the emulator's bus and the flight software's, without I/O or clock.

Frames keep their order. Where faults are armed, an epoch's frames of a direction wait until they are all
there and pass through the faults at once; SYNC's and DONE's counts say how many come out. Without faults
nothing waits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.tools.gateway.answers import Answers
from gnss_hil.tools.gateway.blocks import Blocks
from gnss_hil.tools.gateway.cut import Label, Piece
from gnss_hil.tools.gateway.strikes import Clock, Strikes


@dataclass(frozen=True, slots=True)
class Crossed:
    """Frames that leave, and where to."""

    direction: Direction
    frames: FrameBatch


class Crossing:
    """Both directions of a gateway.

    epochs       that have passed
    interval_ns  between the marks of two epochs; None before there were two
    """

    def __init__(self, codec: Codec, strikes: Strikes):
        self.epochs = 0
        self.interval_ns: int | None = None
        self._clock, self._strikes = Clock(codec), strikes
        self._blocks, self._answers = Blocks(codec), Answers(codec)
        self._more = dict.fromkeys(Direction, 0)
        self._answer = EMPTY
        self._marked: tuple[Label, int] | None = None

    @property
    def ended(self) -> bool:
        """Whether the run's BENCH_END has passed."""
        return self._blocks.ended

    def hear(self, direction: Direction, frames: FrameBatch, now_s: float) -> Iterator[Crossed]:
        """Takes frames that go somewhere, in bus order; what leaves is to be sent before the next is."""
        if not self._strikes.armed:
            if direction is Direction.FLIGHT:
                self.epochs += self._blocks.follow(frames)
            yield Crossed(direction, frames)
        elif direction is Direction.FLIGHT:
            for piece in self._blocks.hear(frames, now_s):
                yield from self._to_flight(piece)
        else:
            for piece in self._answers.hear(frames, now_s):
                yield self._to_receivers(piece)

    def due_s(self) -> float | None:
        """When `expire` has something to do if nothing more is heard; None: never."""
        if not self._strikes.armed:
            return None
        due = (self._blocks.due_s(), self._answers.due_s())
        return min((one for one in due if one is not None), default=None)

    def expire(self, now_s: float) -> Iterator[Crossed]:
        """What leaves because of silence."""
        if not self._strikes.armed:
            return
        for piece in self._blocks.expire(now_s):
            yield from self._to_flight(piece)
        for piece in self._answers.expire(now_s):
            yield self._to_receivers(piece)

    def rest(self) -> Iterator[Crossed]:
        """What waits still leaves as it came: the gateway ends."""
        yield Crossed(Direction.RECEIVERS, self._answers.rest())
        yield Crossed(Direction.FLIGHT, self._blocks.rest())

    def _to_flight(self, piece: Piece) -> Iterator[Crossed]:
        frames = piece.frames
        if piece.label is not None:
            for before in self._answers.next_epoch(piece.label):
                yield self._to_receivers(before)
            self._begin(piece.label, frames)
            frames = self._struck(frames, piece.label, Direction.FLIGHT, 0)
            self.epochs += 1
        yield Crossed(Direction.FLIGHT, concat((frames, self._recounted(piece.closing, Direction.FLIGHT))))

    def _to_receivers(self, piece: Piece) -> Crossed:
        frames, way = piece.frames, Direction.RECEIVERS
        if piece.label is not None:
            frames = self._struck(frames, piece.label, way, self._more[way])
        if len(piece.closing):
            frames = self._answer = concat((frames, self._recounted(piece.closing, way)))
            self._more[way] = 0
        return Crossed(way, concat((frames, self._answer)) if piece.again else frames)

    def _begin(self, label: Label, block: FrameBatch) -> None:
        """An epoch, the first of a run perhaps: its simulated time."""
        last = self._marked
        if last is None or last[0].session != label.session or label.epoch <= last[0].epoch:
            self._strikes.begin(label.session)
            last, self._more = None, dict.fromkeys(Direction, 0)
        t_ns = self._clock.of(block)
        if t_ns is None:
            t_ns = 0 if last is None else last[1] + self._strikes.plan.interval_ns
        elif last is not None and self.interval_ns is None and label.epoch == last[0].epoch + 1:
            self.interval_ns = t_ns - last[1]
        self._strikes.marked(label.epoch, t_ns)
        self._marked = label, t_ns

    def _struck(self, frames: FrameBatch, label: Label, way: Direction, more: int) -> FrameBatch:
        struck = self._strikes.strike(frames, label.epoch, way)
        self._more[way] = more
        if struck is not frames:
            self._more[way] += messages.counted(struck) - messages.counted(frames)
        return struck

    def _recounted(self, closing: FrameBatch, way: Direction) -> FrameBatch:
        """SYNC or DONE, with what faults have put in and taken out."""
        more = self._more[way]
        return messages.recounted(closing, more) if more and len(closing) else closing
