"""A DBC file, or another that cantools reads, as tables of shift, mask and scale."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path

from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, WIDTH
from gnss_hil.tools.common.errors import Mistake

BITS = 8 * WIDTH


@dataclass(frozen=True, slots=True)
class Signal:
    """A signal of a message of at most eight bytes.

    shift     of the payload as one word, little-endian, or big-endian if `swapped`: what is behind the signal
    whole     values are whole numbers: no factor or offset that is none
    choices   raw values and their texts
    selector  place in the message of the signal that tells whether this one is there, None: it always is
    selected  the raw values of the selector with which it is
    """

    name: str
    unit: str
    shift: int
    bits: int
    swapped: bool
    signed: bool
    floating: bool
    factor: float
    offset: float
    whole: bool
    choices: tuple[tuple[int, str], ...]
    selector: int | None
    selected: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Message:
    """can_id  with the flag of extended identifiers;  length  in bytes"""

    name: str
    can_id: int
    length: int
    signals: tuple[Signal, ...]


@dataclass(frozen=True)
class Database:
    """path     of the file, for people
    left_out  signals that do not lie in their messages
    """

    path: str
    messages: tuple[Message, ...]
    left_out: tuple[str, ...] = ()

    @cached_property
    def by_id(self) -> dict[int, int]:
        """Place of a message by its identifier."""
        return {message.can_id: i for i, message in enumerate(self.messages)}

    @cached_property
    def texts(self) -> tuple[str, ...]:
        """All texts of choices."""
        return tuple(dict.fromkeys(text for m in self.messages for s in m.signals for _, text in s.choices))

    def named(self, name: str) -> Message:
        """A message; Mistake if there is none of the name."""
        found = next((m for m in self.messages if m.name == name), None)
        if found is None:
            near = sorted(m.name for m in self.messages if name.lower() in m.name.lower())
            around = f"; near it: {', '.join(near[:5])}" if near else ""
            meant = around or hint(name, [m.name for m in self.messages])
            raise Mistake(f"{self.path}: has no message {name}{meant}")
        return found


def shipped() -> Database:
    """The contract of this bench with four receivers."""
    text = resources.files("gnss_hil.dbc.contract").joinpath("gnss.dbc").read_text("ascii")
    return of_text(text, "gnss.dbc")


def load(path: Path) -> Database:
    """A user's file; Mistake in one line if it cannot be read."""
    from cantools.database import load_file, load_string

    if not path.is_file():
        raise Mistake(f"--dbc {path}: {'is a folder' if path.is_dir() else 'no such file'}")
    try:
        octets = path.read_bytes()
        if not octets.strip():
            raise Mistake(f"--dbc {path}: is empty")
        if octets.startswith(codecs.BOM_UTF8) and path.suffix.lower() == ".dbc":  # cantools takes it for text
            return _database(load_string(octets.decode("utf-8-sig"), "dbc", strict=False), str(path))
        return _database(load_file(str(path), strict=False), str(path))
    except (OSError, MemoryError, Mistake):
        raise
    except Exception as error:  # a foreign parser on a user's file
        raise _unreadable(path, error) from None


def of_text(text: str, path: str) -> Database:
    """The same of the text of a DBC."""
    from cantools.database import load_string

    return _database(load_string(text, "dbc"), path)


def _unreadable(path: Path, error: Exception) -> Mistake:
    line = " ".join(str(error).split()) or type(error).__name__
    return Mistake(f"--dbc {path}: cannot be read: {line[:300]}")


def _database(found, path: str) -> Database:
    messages = getattr(found, "messages", None)
    if messages is None:
        raise Mistake(f"--dbc {path}: has no messages of CAN")
    left_out: list[str] = []
    tables = [_message(m, left_out) for m in messages if m.signals and m.frame_id <= EFF_MASK]
    if not tables:
        raise Mistake(f"--dbc {path}: has no message with a signal")
    return Database(path, tuple(tables), tuple(left_out))


def _message(message, left_out: list[str]) -> Message:
    can_id = message.frame_id | (EFF_FLAG if message.is_extended_frame else 0)
    if message.length > WIDTH:  # no classical frame has room for it
        return Message(message.name, can_id, message.length, ())
    rows = [s for s in message.signals if _shift(s) is not None]
    left_out.extend(f"{message.name}.{s.name}" for s in message.signals if _shift(s) is None)
    names = [s.name for s in rows]
    return Message(message.name, can_id, message.length, tuple(_signals(rows, names)))


def _signals(rows, names: list[str]) -> Iterator[Signal]:
    for s in rows:
        selector = names.index(s.multiplexer_signal) if s.multiplexer_signal in names else None
        whole = not s.is_float and isinstance(s.scale, int) and isinstance(s.offset, int) and _fits(s)
        yield Signal(
            name=s.name, unit=s.unit or "", shift=_shift(s) or 0, bits=s.length,
            swapped=s.byte_order == "big_endian", signed=s.is_signed, floating=s.is_float,
            factor=s.scale, offset=s.offset, whole=whole,
            choices=tuple((raw, str(text)) for raw, text in (s.choices or {}).items()),
            selector=selector, selected=tuple(s.multiplexer_ids or ()) if selector is not None else (),
        )  # fmt: skip


def _fits(s) -> bool:
    """Whether no value is beyond a word of 64 bits."""
    return (s.scale, s.offset) == (1, 0) or abs(s.scale) * 2**s.length + abs(s.offset) < 2**63


def _shift(s) -> int | None:
    """How far a signal is from the end of its word; None if it does not lie in eight bytes.

    A big-endian signal starts at its highest bit, counted as DBC files do: byte after byte, each from its
    lowest bit.
    """
    if s.byte_order == "big_endian":
        first = 8 * (s.start // 8) + 7 - s.start % 8
        shift = BITS - first - s.length
    else:
        shift = s.start
    return shift if 0 < s.length <= BITS and 0 <= shift <= BITS - s.length else None
