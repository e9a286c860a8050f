"""Recordings of a bus in the formats that people have: one way to read them, one to write them.

What a format cannot hold, besides CAN FD frames, which are counted and left out:

    .log  candump       nothing is lost (a frame that was sent has a T behind it)
    .asc  Vector ASC    names of buses (channel 1 is can0); of an error frame all but its time and bus;
                        the time zone (local time, as Vector has it)
    .blf  Vector BLF    names of buses
    .mf4  ASAM MDF 4    names of buses; the order of data, error and remote frames of the same microsecond
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Protocol

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.formats.piece import Findings, LogError, Piece


class Writer(Protocol):
    def write(self, piece: Piece) -> None:
        """Frames in the order of the file."""

    def close(self) -> None:
        """The file is whole after this, not before."""


@dataclass(frozen=True, slots=True)
class Format:
    """A way to keep a recording.

    reader  module of `formats`, and function (path, findings) -> pieces
    writer  module of `formats`, and class
    named   keeps the names of buses, and frames in any order
    """

    name: str
    reader: tuple[str, str]
    writer: tuple[str, str]
    named: bool = False


FORMATS = {
    ".log": Format("candump", ("candump", "read"), ("candump", "CandumpWriter"), named=True),
    ".asc": Format("Vector ASC", ("asc.reader", "read"), ("asc.writer", "AscWriter")),
    ".blf": Format("Vector BLF", ("blf.reader", "read"), ("blf.writer", "BlfWriter")),
    ".mf4": Format("ASAM MDF 4", ("mf4.reader", "read"), ("mf4.writer", "Mf4Writer")),
}


def format_of(path: Path) -> Format:
    """The format of a file's suffix; Mistake names what is allowed."""
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise Mistake(f"{path}: suffix '{path.suffix}' is no recording; allowed are {', '.join(FORMATS)}")
    return found


@dataclass(slots=True)
class Recording:
    """A recording to be read, several times if need be.

    found  what the last reading came upon besides frames; whole when it has come to the end
    """

    path: Path
    found: Findings = field(default_factory=Findings)

    def __post_init__(self) -> None:
        format_of(self.path)
        if not self.path.is_file():
            raise Mistake(f"{self.path}: {'is a folder' if self.path.is_dir() else 'no such file'}")

    def pieces(self) -> Iterator[Piece]:
        """All frames; LogError tells where the file is none of its format."""
        self.found = Findings()
        return _of_formats(format_of(self.path).reader)(self.path, self.found)


MAX_CHANNELS = 255
"""Of the formats that number their buses."""


class Channels(dict[bytes, int]):
    """Numbers of buses, from 0: the number in the name (can1, vcan1), else, or if that is taken, the next."""

    def __missing__(self, name: bytes) -> int:
        digits = re.search(rb"\d{1,3}$", name)
        taken = set(self.values())
        wanted = int(digits[0]) if digits else 0
        free = (n for n in (wanted, *range(MAX_CHANNELS)) if n not in taken and n < MAX_CHANNELS)
        number = next(free, None)
        if number is None:
            raise LogError(f"more than {MAX_CHANNELS} buses: only .log has room for them")
        self[name] = number
        return number

    @property
    def renamed(self) -> dict[str, str]:
        """Names that come back as others."""
        return {name.decode(): f"can{n}" for name, n in self.items() if name != b"can%d" % n}


def open_writer(path: Path, kind: Format, channels: Mapping[bytes, int]) -> Writer:
    """A writer of a format on a file of any name."""
    return _of_formats(kind.writer)(path, channels)


def _of_formats(place: tuple[str, str]):
    """What stands in a module of `formats`; imported late, because some take time."""
    module, name = place
    return getattr(import_module(f"gnss_hil.tools.recording.formats.{module}"), name)
