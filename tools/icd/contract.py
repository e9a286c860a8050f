"""The contract as cantools reads it from the DBC: layouts with the messages that have them, groups, nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cantools.database import Database
from cantools.database.can import Message, Signal

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.messages import KIND_BY_NAME

SENT = {"epoch": "in every epoch", "bulk": "a slice in every epoch", "event": "when needed"}


@dataclass(frozen=True, slots=True)
class Group:
    """Identifiers `first` to `last` serve one purpose; `tone` is its colour in the style sheet."""

    first: int
    last: int
    name: str
    tone: int


GROUPS = (
    Group(0x010, 0x01F, "time mark", 0),
    Group(0x020, 0x02F, "commands", 1),
    Group(0x030, 0x03F, "answers", 2),
    Group(0x040, 0x05F, "navigation", 3),
    Group(0x060, 0x06F, "attitude", 4),
    Group(0x100, 0x17F, "measurements", 5),
    Group(0x400, 0x47F, "almanac", 6),
    Group(0x700, 0x71F, "heartbeats", 7),
    Group(0x7D0, 0x7DE, "bench", 8),
)
"""By priority. A message belongs to the group that its identifier is in."""


@dataclass(frozen=True, slots=True)
class Layout:
    """One layout of eight bytes, and the messages of the DBC that have it, by identifier."""

    name: str
    messages: tuple[Message, ...]

    @property
    def signals(self) -> list[Signal]:
        return sorted(self.messages[0].signals, key=lambda s: s.start)

    @property
    def comment(self) -> str:
        return self.messages[0].comment or ""

    @property
    def group(self) -> Group:
        return group_of(self.messages[0].frame_id)

    @property
    def protected(self) -> bool:
        return "E2EProfile" in _attributes(self.messages[0])

    @property
    def stream_key(self) -> str:
        attributes = _attributes(self.messages[0])
        return str(attributes["E2EStreamKey"].value) if "E2EStreamKey" in attributes else ""

    @property
    def repeats(self) -> bool:
        """Whether its messages are named after their sender, even if there is only one of them."""
        return self.messages[0].name != self.name

    @property
    def sent(self) -> str:
        return SENT[KIND_BY_NAME[self.name].cycle]


@dataclass(frozen=True, slots=True)
class Contract:
    """What the document is of."""

    codec: Codec
    database: Database
    layouts: tuple[Layout, ...]

    @property
    def messages(self) -> list[Message]:
        return sorted(self.database.messages, key=lambda m: m.frame_id)

    @property
    def hash(self) -> str:
        return f"0x{self.codec.hash:08X}"

    def table_of(self, signal: Signal) -> str:
        """Name of a signal's value table in the DBC, '' if it has none."""
        if not signal.choices:
            return ""
        choices = labels(signal.choices)
        return next(name for name, table in self.value_tables().items() if table == choices)

    def value_tables(self) -> dict[str, dict[int, str]]:
        dbc = self.database.dbc
        return {name: labels(table) for name, table in dbc.value_tables.items()} if dbc else {}


def _attributes(message: Message) -> Mapping:
    return message.dbc.attributes if message.dbc else {}


def labels(choices) -> dict[int, str]:
    return {raw: str(label) for raw, label in choices.items()}


def group_of(can_id: int) -> Group:
    return next(g for g in GROUPS if g.first <= can_id <= g.last)


def load(codec: Codec) -> Contract:
    """Reads the DBC text of a codec; messages that share a layout are one `Layout`."""
    database = Database()
    database.add_dbc_string(codec.text)
    members: dict[str, list[Message]] = {}
    for message in sorted(database.messages, key=lambda m: m.frame_id):
        members.setdefault(codec.layouts[codec.kind_of[message.frame_id]].name, []).append(message)
    return Contract(codec, database, tuple(Layout(name, tuple(same)) for name, same in members.items()))
