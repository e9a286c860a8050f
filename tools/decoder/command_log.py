"""Channel commands and their answers, as they pass on the bus."""

from __future__ import annotations

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.messages import VALUES
from gnss_hil.tools.decoder.block import Block

_ACTION = VALUES["Action"]
_RESULT = VALUES["AckResult"]
_ACCEPTED = 0


class CommandLog:
    """Commands, acknowledgements and handovers of one bus, epoch by epoch.

    A repeat carries the transaction number of the channel's last command and is not counted again. A handover
    is a satellite that one epoch's commands take from one receiver and give to another.

    handed  t_ns, satellite, receiver before, receiver after, of every handover
    """

    def __init__(self):
        self.commands = self.repeats = self.rejected = 0
        self.handed: list[tuple[int, int, int, int]] = []
        self.events: dict[str, list] = {
            name: []
            for name in (
                "t_ns",
                "event",
                "receiver",
                "channel",
                "action",
                "satellite",
                "transaction",
                "result",
            )
        }
        self._last: dict[tuple[int, int], int] = {}
        self._held: dict[tuple[int, int], int] = {}

    def take(self, t_ns: I64, block: Block) -> None:
        """The COMMAND and ACK frames of some epochs, t_ns (e,) the times of their marks."""
        rows = []
        for order, kind in enumerate(("ACK", "COMMAND")):
            said = block[kind]
            word = said["action" if kind == "COMMAND" else "result"]
            columns = (said.number, said["channel"], word, said.satellite, said["transaction"])
            values = zip(said.epoch.tolist(), *(column.tolist() for column in columns), strict=True)
            rows += [(epoch, order, i, kind, *rest) for i, (epoch, *rest) in enumerate(values)]
        rows.sort(key=lambda row: row[:3])
        begin = 0
        for end in range(1, len(rows) + 1):
            if end == len(rows) or rows[end][0] != rows[begin][0]:
                self._epoch(int(t_ns[rows[begin][0]]), rows[begin:end])
                begin = end

    def _epoch(self, t_ns: int, rows: list[tuple]) -> None:
        before = {sat: receiver for (receiver, _), sat in self._held.items()}
        for _, _, _, kind, receiver, channel, word, sat, transaction in rows:
            name = satellites.name(sat) if sat % satellites.NUMBERS else ""
            if kind == "ACK":
                self.rejected += word != _ACCEPTED
                self._note(
                    t_ns, "ack", receiver, channel, "", name, transaction, _RESULT.get(word, str(word))
                )
                continue
            action = _ACTION.get(word, str(word))
            repeated = self._last.get((receiver, channel)) == transaction
            self._last[receiver, channel] = transaction
            self.commands += not repeated
            self.repeats += repeated
            self._note(
                t_ns, "repeat" if repeated else "command", receiver, channel, action, name, transaction, ""
            )
            if action == "TRACK":
                self._held[receiver, channel] = sat
            else:
                self._held.pop((receiver, channel), None)
        after = {sat: receiver for (receiver, _), sat in self._held.items()}
        self.handed += [
            (t_ns, sat, receiver, after[sat])
            for sat, receiver in before.items()
            if after.get(sat, receiver) != receiver
        ]

    @property
    def handovers(self) -> int:
        return len(self.handed)

    def _note(self, *values) -> None:
        for column, value in zip(self.events.values(), values, strict=True):
            column.append(value)
