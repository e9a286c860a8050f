"""Recordings of a bus in the formats that people have: one way to read them, one to write them.

What a format cannot hold, besides CAN FD frames, which are counted and left out:

    .log  candump       nothing is lost
    .asc  Vector ASC    names of buses (channel 1 is can0); of an error frame all but its time and bus; the time
                        zone (local time, as Vector has it)
    .blf  Vector BLF    names of buses
    .mf4  ASAM MDF 4    names of buses; the order of data, error and remote frames of the same microsecond
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Protocol

import numpy as np

from tools.errors import Mistake
from tools.log.candump import LogError, Piece, format_lines, read_chunks


class Writer(Protocol):
    def write(self, piece: Piece) -> None:
        """Frames in the order of the file."""

    def close(self) -> None:
        """The file is whole after this, not before."""


@dataclass(frozen=True, slots=True)
class Format:
    """A way to keep a recording.

    reader  python-can's class, None where we read ourselves
    writer  module and class of ours, or python-can's
    named   keeps the names of buses, and frames in any order
    """

    name: str
    reader: str | None
    writer: tuple[str, str]
    named: bool = False


FORMATS = {
    ".log": Format("candump", None, ("tools.log.recording", "CandumpWriter"), named=True),
    ".asc": Format("Vector ASC", "ASCReader", ("tools.log.asc", "AscWriter")),
    ".blf": Format("Vector BLF", "BLFReader", ("tools.log.recording", "BlfWriter")),
    ".mf4": Format("ASAM MDF 4", "MF4Reader", ("tools.log.mf4", "Mf4Writer")),
}


def format_of(path: Path) -> Format:
    """The format of a file's suffix; Mistake says what is allowed."""
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise Mistake(f"{path}: suffix '{path.suffix}' is no recording; allowed are {', '.join(FORMATS)}")
    return found


@dataclass(slots=True)
class Recording:
    """A recording to be read, several times if need be.

    omitted  frames that the last reading left out, by reason
    share    of the file that has been read, 0 to 1; None where the format does not tell
    """

    path: Path
    omitted: Counter[str] = field(default_factory=Counter)
    share: float | None = None

    def __post_init__(self) -> None:
        format_of(self.path)
        if not self.path.is_file():
            raise Mistake(f"{self.path}: {'is a folder' if self.path.is_dir() else 'no such file'}")

    def pieces(self) -> Iterator[Piece]:
        """All frames; LogError tells where the file is none of its format."""
        self.omitted.clear()
        self.share = None
        reader = format_of(self.path).reader
        return self._candump() if reader is None else self._foreign(reader)

    def _candump(self) -> Iterator[Piece]:
        with self.path.open("rb") as log:
            size = max(os.fstat(log.fileno()).st_size, 1)
            for piece in read_chunks(log, str(self.path), omitted=self.omitted):
                self.share = log.tell() / size
                yield piece

    def _foreign(self, name: str) -> Iterator[Piece]:
        import can

        from tools.log.messages import pieces_of

        if name == "MF4Reader":
            import_module("tools.log.mf4").require()
        more = {"relative_timestamp": False} if name == "ASCReader" else {}
        reader, told = None, 0
        try:
            reader = getattr(can, name)(self.path, **more)
            for piece in pieces_of(reader, str(self.path), self.omitted):
                self.share = _share(reader, self.path)
                told += len(piece[0])
                yield piece
        except (LogError, OSError, MemoryError):
            raise
        except Exception as error:  # whatever a parser of somebody else's makes of a damaged file
            said = " ".join(str(error).split()) or type(error).__name__
            what = format_of(self.path).name
            raise LogError(f"{self.path}: not {what}, or damaged after {told} frames: {said}") from None
        finally:
            if reader is not None:
                with suppress(Exception):  # of a damaged file
                    reader.stop()


def _share(reader, path: Path) -> float | None:
    """How far a reader of python-can is in its file."""
    stream = getattr(reader, "file", None)
    stream = getattr(stream, "buffer", stream)  # a text file does not tell while it is iterated
    try:
        return stream.tell() / max(path.stat().st_size, 1)
    except (AttributeError, OSError, ValueError):
        return None


class Channels(dict[bytes, int]):
    """Numbers of buses, from 0: the number in the name (can1, vcan1), else, or if that is taken, the next."""

    def __missing__(self, name: bytes) -> int:
        digits = re.search(rb"\d{1,3}$", name)
        taken = set(self.values())
        wanted = int(digits[0]) if digits else 0
        free = next(n for n in (wanted, *range(256)) if n not in taken and n < 255)
        self[name] = free
        return free

    @property
    def renamed(self) -> dict[str, str]:
        """Names that come back as others."""
        return {name.decode(): f"can{n}" for name, n in self.items() if name != b"can%d" % n}


def open_writer(path: Path, kind: Format, channels: Mapping[bytes, int]) -> Writer:
    """A writer of a format on a file of any name."""
    module, name = kind.writer
    return getattr(import_module(module), name)(path, channels)


class CandumpWriter:
    """Text of `candump -l`."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        self._file = path.open("wb")

    def write(self, piece: Piece) -> None:
        unix_us, bus, frames = piece
        names = np.unique(bus).tolist()
        if len(names) == 1:
            self._file.write(format_lines(unix_us, frames, names[0].decode()))
            return
        lines = np.empty(len(frames), object)
        for name in names:
            mine = bus == name
            text = format_lines(unix_us[mine], frames[mine], name.decode())
            lines[mine] = text.splitlines(keepends=True)
        self._file.write(b"".join(lines))

    def close(self) -> None:
        self._file.close()


class BlfWriter:
    """python-can's writer of Vector's binary log."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        import can

        self._channels = channels
        self._log = can.BLFWriter(path)

    def write(self, piece: Piece) -> None:
        from tools.log.messages import messages_of

        for message in messages_of(piece, self._channels):
            self._log.on_message_received(message)

    def close(self) -> None:
        self._log.stop()


def buses_of(pieces: Sequence[Piece]) -> list[str]:
    """Names of the buses in pieces, in order."""
    return sorted({name.decode() for _, bus, _ in pieces for name in set(bus.tolist())})
