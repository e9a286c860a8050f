"""A craft's bus inside one process: how frames come to the flight software, the emulator and the record.

Without faults nothing can happen to them. Where faults are armed, marks may be missing and bench frames
stray: then both sides of lockstep and the recorder's order stand between, so that the record is a bus's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.dbc.lockstep.master_protocol import Exchange
from gnss_hil.dbc.lockstep.slave_protocol import Slave, Task
from gnss_hil.tools.recording.account import Heard
from gnss_hil.tools.recording.sequence import Epoch, Sequencer

Fly = Callable[[FrameBatch, bool], FrameBatch]
"""The flight software: block heard, whether to start from a fresh state -> block to send."""


@dataclass(frozen=True, slots=True)
class Played:
    """An epoch: what the emulator hears, epochs that are complete for the record, whether it was answered."""

    inbox: FrameBatch
    epochs: list[Epoch]
    answered: bool = True


class Direct:
    """Block to flight software, answer to emulator."""

    def __init__(self, fly: Fly):
        self._fly = fly

    def play(self, epoch: int, block: FrameBatch) -> Played:
        answer = self._fly(block, False)
        return Played(answer, [Epoch(epoch, concat((block, answer)))])

    def end(self, epochs: int, reason: str) -> list[Epoch]:
        """What is still to be recorded."""
        return []

    def account(self, epochs: int) -> None:
        """Nothing can go wrong."""


class Steered:
    """The same by the protocols of both sides and the order of the record."""

    def __init__(self, codec: Codec, session: int, fly: Fly):
        self._fly = fly
        self._exchange = Exchange(codec, session, {})
        self._slave = Slave(codec)
        self._sequencer = Sequencer(codec, lockstep=True, session=session)

    def play(self, epoch: int, block: FrameBatch) -> Played:
        heard = self._exchange.open(epoch, block)
        said = self._answer(heard)
        answered = self._exchange.hear(said)
        return Played(self._exchange.inbox(), self._sequencer.hear(concat((heard, said))), answered)

    def _answer(self, heard: FrameBatch) -> FrameBatch:
        said = [EMPTY]
        for work in self._slave.hear(heard, 0.0):
            if work.task is Task.STEP:
                said.append(self._slave.answer(self._fly(work.block, work.fresh)))
            elif work.task is Task.REPEAT:
                said.append(work.block)
        return concat(said)

    def end(self, epochs: int, reason: str) -> list[Epoch]:
        """What is still to be recorded."""
        over = self._exchange.end(epochs, reason)
        return [*self._sequencer.hear(over), *self._sequencer.finish()]

    def account(self, epochs: int) -> Heard:
        """What was counted of the bus, so many epochs on record."""
        return self._sequencer.account(epochs)
