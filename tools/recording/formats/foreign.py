"""Recordings that python-can reads; its readers with what this bench expects where a file is damaged."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can

from gnss_hil.tools.recording.formats.candump import LogError

_HEAD_BYTES = 4096
_BLF_SIZE = slice(16, 24)
"""Where the file header has the size of the whole file, little-endian."""


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """A file that is being read.

    messages   python-can's reader of it
    file       the bytes under it, None where its place in them does not tell what has been read
    complaint  what is wrong with the file as a whole, once it has been read; "" if nothing is
    """

    messages: Any
    file: Any = None
    complaint: Callable[[], str] = str

    def tell(self) -> int | None:
        """Bytes read, None if that cannot be known; python-can closes a file that it has read."""
        return None if self.file is None or self.file.closed else self.file.tell()


class _WholeLines(io.TextIOWrapper):
    """Lines without a last one that is cut short: it would read as a frame with other contents."""

    cut = ""

    def __next__(self) -> str:
        line = super().__next__()
        if not line.endswith("\n"):
            self.cut = line
            raise StopIteration
        return line

    def complaint(self) -> str:
        frame = self.cut.lstrip()[:1].isdigit()
        return "is cut short in its last line, which is left out" if frame else ""


def open_asc(path: Path) -> Reading:
    """Frames of an ASC file at their absolute times."""
    raw = path.open("rb")
    head = raw.read(_HEAD_BYTES).lower()
    raw.seek(0)
    if b"base " not in head and b"date " not in head:
        raw.close()
        raise LogError(f"{path}: not Vector ASC: neither a date nor a base line")
    lines = _WholeLines(raw, "utf-8", "replace")  # does not tell where it is while it is iterated
    return Reading(can.ASCReader(lines, relative_timestamp=False), raw, lines.complaint)


def open_blf(path: Path) -> Reading:
    """Frames of a BLF file."""

    def complaint() -> str:
        size = path.stat().st_size
        with path.open("rb") as file:
            announced = int.from_bytes(file.read(_BLF_SIZE.stop)[_BLF_SIZE], "little")
        return f"is cut short: {size} bytes of {announced}" if size < announced else ""

    reader = can.BLFReader(path)
    return Reading(reader, reader.file, complaint)


def open_mf4(path: Path) -> Reading:
    """Frames of an MF4 file."""
    from gnss_hil.tools.recording.formats.mf4 import open_reader

    return Reading(open_reader(path))
