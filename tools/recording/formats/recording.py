"""Recordings of a bus in the formats that people have: one way to read them, one to write them.

What a format cannot hold, besides CAN FD frames, which are counted and left out:

    .log  candump       nothing is lost
    .asc  Vector ASC    names of buses (channel 1 is can0); of an error frame all but its time and bus;
                        the time zone (local time, as Vector has it)
    .blf  Vector BLF    names of buses
    .mf4  ASAM MDF 4    names of buses; the order of data, error and remote frames of the same microsecond
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Protocol

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.formats.candump import LogError, Piece, read_chunks


class Writer(Protocol):
    def write(self, piece: Piece) -> None:
        """Frames in the order of the file."""

    def close(self) -> None:
        """The file is whole after this, not before."""


@dataclass(frozen=True, slots=True)
class Format:
    """A way to keep a recording.

    reader  function of `formats.foreign`, None where we read ourselves
    writer  module of `formats`, and class
    named   keeps the names of buses, and frames in any order
    """

    name: str
    reader: str | None
    writer: tuple[str, str]
    named: bool = False


FORMATS = {
    ".log": Format("candump", None, ("candump", "CandumpWriter"), named=True),
    ".asc": Format("Vector ASC", "open_asc", ("asc", "AscWriter")),
    ".blf": Format("Vector BLF", "open_blf", ("foreign", "BlfWriter")),
    ".mf4": Format("ASAM MDF 4", "open_mf4", ("mf4", "Mf4Writer")),
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

    omitted    frames that the last reading left out, by reason
    complaint  what is wrong with the file as a whole, known when it has been read; "" if nothing is
    share      of the file that has been read, 0 to 1; None where the format does not tell
    """

    path: Path
    omitted: Counter[str] = field(default_factory=Counter)
    complaint: str = ""
    share: float | None = None

    def __post_init__(self) -> None:
        format_of(self.path)
        if not self.path.is_file():
            raise Mistake(f"{self.path}: {'is a folder' if self.path.is_dir() else 'no such file'}")

    def pieces(self) -> Iterator[Piece]:
        """All frames; LogError tells where the file is none of its format."""
        self.omitted.clear()
        self.complaint, self.share = "", None
        reader = format_of(self.path).reader
        return self._candump() if reader is None else self._foreign(reader)

    def _candump(self) -> Iterator[Piece]:
        with self.path.open("rb") as log:
            size = max(os.fstat(log.fileno()).st_size, 1)
            for piece in read_chunks(log, str(self.path), omitted=self.omitted):
                self.share = log.tell() / size
                yield piece

    def _foreign(self, name: str) -> Iterator[Piece]:
        read, size = 0, max(self.path.stat().st_size, 1)
        try:
            foreign = import_module("gnss_hil.tools.recording.formats.foreign")  # python-can takes time
            opened = getattr(foreign, name)(self.path)
            try:
                for piece in foreign.pieces_of(opened.messages, str(self.path), self.omitted):
                    at = opened.tell()
                    self.share = None if at is None else at / size
                    read += len(piece[0])
                    yield piece
                self.complaint = opened.complaint()
            finally:
                with suppress(Exception):  # of a damaged file: the fault is reported already
                    opened.messages.stop()
        except (LogError, OSError, MemoryError, Mistake):
            raise
        except Exception as error:  # whatever a foreign parser makes of a damaged file
            fault = " ".join(str(error).split()) or type(error).__name__
            what = format_of(self.path).name
            where = f"damaged after {read} frames or more"
            raise LogError(f"{self.path}: not {what}, or {where}: {fault}") from None


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
    module, name = kind.writer
    return getattr(import_module(f"gnss_hil.tools.recording.formats.{module}"), name)(path, channels)
