"""Recordings that python-can reads; its readers with what this bench expects where a file is damaged.

Each yields messages, gives its place in the file (`tell`, None if it cannot know), and at the end what is
wrong with the file as a whole (`complaint`, "" if nothing is).
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import can

from gnss_hil.tools.recording.formats.candump import LogError

_HEAD_BYTES = 4096
_BLF_SIZE = slice(16, 24)
"""Where the file header has the size of the whole file, little-endian."""


def _position(file: IO[bytes] | io.BufferedIOBase) -> int | None:
    """Bytes read; python-can closes a file that it has read."""
    return None if file.closed else file.tell()


class _WholeLines(io.TextIOWrapper):
    """Lines without a last one that is cut short: it would read as a frame with other contents."""

    cut = ""

    def __next__(self) -> str:
        line = super().__next__()
        if not line.endswith("\n"):
            self.cut = line
            raise StopIteration
        return line


class AscReader:
    """Frames of an ASC file at their absolute times."""

    def __init__(self, path: Path):
        raw = path.open("rb")
        head = raw.read(_HEAD_BYTES).lower()
        raw.seek(0)
        if b"base " not in head and b"date " not in head:
            raw.close()
            raise LogError(f"{path}: not Vector ASC: neither a date nor a base line")
        self._raw = raw  # the text around it does not tell where it is while it is iterated
        self._lines = _WholeLines(raw, "utf-8", "replace")
        self._reader = can.ASCReader(self._lines, relative_timestamp=False)

    def __iter__(self) -> Iterator[can.Message]:
        return iter(self._reader)

    def tell(self) -> int | None:
        return _position(self._raw)

    def complaint(self) -> str:
        frame = self._lines.cut.lstrip()[:1].isdigit()
        return "is cut short in its last line, which is left out" if frame else ""

    def stop(self) -> None:
        self._reader.stop()


class BlfReader:
    """Frames of a BLF file."""

    def __init__(self, path: Path):
        self._path = path
        self._reader = can.BLFReader(path)

    def __iter__(self) -> Iterator[can.Message]:
        return iter(self._reader)

    def tell(self) -> int | None:
        return _position(self._reader.file)

    def complaint(self) -> str:
        size = self._path.stat().st_size
        with self._path.open("rb") as file:
            said = int.from_bytes(file.read(_BLF_SIZE.stop)[_BLF_SIZE], "little")
        return f"is cut short: {size} bytes of {said}" if size < said else ""

    def stop(self) -> None:
        self._reader.stop()


class Mf4Reader:
    """Frames of an MF4 file; where in the file they are is not known."""

    def __init__(self, path: Path):
        from gnss_hil.tools.recording.formats.mf4 import open_reader

        self._reader = open_reader(path)

    def __iter__(self) -> Iterator[can.Message]:
        return iter(self._reader)

    def tell(self) -> None:
        return None

    def complaint(self) -> str:
        return ""

    def stop(self) -> None:
        self._reader.stop()
