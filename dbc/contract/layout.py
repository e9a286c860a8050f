"""What a message of the contract is made of: signals, and kinds of messages."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Signal:
    """Bits of a message, and the number that they are: raw times factor plus offset, in the unit.

    values  value table that names raw values, "" if none does
    start   first bit, little-endian, -1 where it is not laid out yet
    """

    name: str
    bits: int
    factor: float = 1
    offset: float = 0
    unit: str = ""
    signed: bool = False
    values: str = ""
    start: int = -1
    comment: str = ""

    @property
    def raw_range(self) -> tuple[int, int]:
        """The least and the greatest raw value."""
        top = 1 << self.bits - self.signed
        return (-top, top - 1) if self.signed else (0, top - 1)


@dataclass(frozen=True, slots=True)
class Kind:
    """One message layout and where it stands on the bus.

    per       "" (one message), "receiver" or "node"
    base      identifier of the first; `stride` to the next receiver's
    key       signal that, with the identifier, names a protected stream ("" : the identifier alone)
    cycle     "epoch" (every epoch), "bulk" (a slice every epoch), "event"
    """

    name: str
    base: int
    sender: str
    receivers: tuple[str, ...]
    comment: str
    signals: tuple[Signal, ...]
    per: str = ""
    stride: int = 0
    key: str = ""
    cycle: str = "epoch"


def laid_out(signals: tuple[Signal, ...], start: int) -> tuple[Signal, ...]:
    """Signals one behind the other, the first at a bit."""
    placed = []
    for s in signals:
        placed.append(replace(s, start=start))
        start += s.bits
    assert start <= 64, f"{[s.name for s in signals]} needs {start} bits"
    return tuple(placed)
