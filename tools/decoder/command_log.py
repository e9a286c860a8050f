"""Channel commands and their answers, as they pass on the bus."""

from __future__ import annotations

from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.decoder.block import Block

_ACTION = VALUES["Action"]
_RESULT = VALUES["AckResult"]
_ACCEPTED = 0
_SIGNALS = ("channel", "satellite", "transaction")
_EVENTS = ("t_ns", "event", "receiver", "channel", "action", "satellite", "transaction", "result")


class Exchange(NamedTuple):
    """A command or its answer: row of the epoch, kind, receiver (1-based), action or result, channel,
    satellite index, transaction."""

    epoch: int
    kind: str
    receiver: int
    word: int
    channel: int
    sat: int
    transaction: int


def exchanges(block: Block) -> list[Exchange]:
    """Commands and answers in order. In an epoch answers come first: they are to commands of one before."""
    rows: list[Exchange] = []
    for kind, word in (("ACK", "result"), ("COMMAND", "action")):
        frames = block[kind]
        columns = (frames.epoch, frames.number, *(frames[name] for name in (word, *_SIGNALS)))
        values = zip(*(column.tolist() for column in columns), strict=True)
        rows += [Exchange(epoch, kind, *rest) for epoch, *rest in values]
    return sorted(rows, key=attrgetter("epoch", "kind"))


class CommandLog:
    """Commands, acknowledgements and handovers of one bus, epoch by epoch.

    A repeat carries the transaction number of the channel's last command and is not counted again. A handover
    is a satellite that one epoch's commands take from one receiver and give to another.

    handed  t_ns, satellite, receiver before, receiver after, of every handover
    """

    def __init__(self):
        self.commands = self.repeats = self.rejected = 0
        self.handed: list[tuple[int, int, int, int]] = []
        self.events: dict[str, list] = {name: [] for name in _EVENTS}
        self._last: dict[tuple[int, int], int] = {}
        self._held: dict[tuple[int, int], int] = {}

    def take(self, t_ns: I64, block: Block) -> None:
        """The COMMAND and ACK frames of some epochs, t_ns (e,) the times of their marks."""
        for epoch, rows in groupby(exchanges(block), key=attrgetter("epoch")):
            before = self._receiver_of
            for exchange in rows:
                self._note(int(t_ns[epoch]), exchange)
            after = self._receiver_of
            self.handed += [
                (int(t_ns[epoch]), sat, receiver, after[sat])
                for sat, receiver in before.items()
                if after.get(sat, receiver) != receiver
            ]

    @property
    def _receiver_of(self) -> dict[int, int]:
        """Receiver that is commanded to track a satellite."""
        return {sat: receiver for (receiver, _), sat in self._held.items()}

    def _note(self, t_ns: int, one: Exchange) -> None:
        event, action, result = "ack", "", ""
        channel = one.receiver, one.channel
        if one.kind == "ACK":
            result = _RESULT.get(one.word, str(one.word))
            self.rejected += one.word != _ACCEPTED
        else:
            action = _ACTION.get(one.word, str(one.word))
            repeated = self._last.get(channel) == one.transaction
            event = "repeat" if repeated else "command"
            self._last[channel] = one.transaction
            self.commands += not repeated
            self.repeats += repeated
            if action == "TRACK":
                self._held[channel] = one.sat
            else:
                self._held.pop(channel, None)
        name = satellites.name(one.sat) if one.sat % satellites.NUMBERS else ""
        values = (t_ns, event, *channel, action, name, one.transaction, result)
        for column, value in zip(self.events.values(), values, strict=True):
            column.append(value)

    @property
    def handovers(self) -> int:
        return len(self.handed)
