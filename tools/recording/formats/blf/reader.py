"""Frames of a BLF file, whole stretches of it at a time."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from gnss_hil.tools.recording.formats.blf.containers import stretches
from gnss_hil.tools.recording.formats.blf.objects import (
    BASE_BYTES,
    FRAME_BYTES,
    FRAMES,
    OTHERS,
    chain,
    frames,
)
from gnss_hil.tools.recording.formats.piece import CUT, Findings, LogError, Piece, sound

_HEADER = struct.Struct(
    "<4sL8xQQ2L8H"
)  # signature, header's size, file's, uncompressed, objects, read; start
JOINED_BYTES = 1 << 20
"""What is looked at together, at least."""


def read(path: Path, found: Findings) -> Iterator[Piece]:
    """The frames of a file; LogError if it is none or where it is damaged."""
    with path.open("rb") as file:
        size = path.stat().st_size
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size or head[:4] != b"LOGG":
            raise LogError(
                f"{path}: not Vector BLF: begins with {head[:4].hex(' ') or 'nothing'}, not with LOGG"
            )
        _, header_bytes, announced, _, _, _, *start = _HEADER.unpack(head)
        if not _HEADER.size <= header_bytes <= 1 << 16:
            raise LogError(f"{path}: is damaged: a header of {header_bytes} bytes at byte 4")
        start_us = _unix_us(start)
        objects = _Objects(str(path), found)
        for data in _together(stretches(file, header_bytes, str(path), found)):
            piece = objects.take(data, start_us)
            found.share = file.tell() / size
            yield piece
        objects.close()
        if size < announced and not any(CUT in remark for remark in found.remarks):
            found.remarks.append(f"is cut short: {size} bytes of {announced}")
        if start_us == 0:
            found.remarks.append("has no start of the measurement: times count from 1970-01-01 UTC")


def _unix_us(start: list[int]) -> int:
    """UNIX time [us] of a SYSTEMTIME, which is taken for UTC as python-can does; 0 if it is none."""
    year, month, _, day, hour, minute, second, milli = start
    try:
        at = datetime(year, month, day, hour, minute, second, milli * 1000, UTC)
    except ValueError:
        return 0
    return round(at.timestamp()) * 1_000_000 if not milli else int(at.timestamp()) * 1_000_000 + milli * 1000


def _together(stretches: Iterator[bytes]) -> Iterator[bytes]:
    """The same bytes in longer stretches."""
    parts, amount = [], 0
    for part in stretches:
        parts.append(part)
        amount += len(part)
        if amount >= JOINED_BYTES:
            yield b"".join(parts)
            parts, amount = [], 0
    if parts:
        yield b"".join(parts)


class _Objects:
    """Objects in stretches that they may cross.

    rest    the beginning of one that goes on
    skip    bytes still to come of a long one that is no frame
    before  bytes in the stretches before, for messages
    """

    def __init__(self, origin: str, found: Findings):
        self._origin = origin
        self._found = found
        self._rest = b""
        self._skip = 0
        self._before = 0

    def take(self, data: bytes, start_us: int) -> Piece:
        """The frames of the objects that end in the next stretch."""
        if self._skip:
            skipped = min(self._skip, len(data))
            data, self._skip, self._before = data[skipped:], self._skip - skipped, self._before + skipped
        data = self._rest + data
        origin = f"{self._origin}: is damaged: behind {self._before} uncompressed bytes"
        place, size = chain(data, origin)
        whole = place + size <= len(data)
        self._keep(data, place, size, origin)
        found = self._found
        heard = frames(data, place[whole], size[whole], found.omitted, found.passed, origin)
        unix_us = (heard.ns + 500) // 1000 + start_us
        return sound(unix_us, heard.channel, heard.frames, heard.sent, self._origin, found.omitted)

    def _keep(self, data: bytes, place, size, origin: str) -> None:
        """Remember what goes on in the next stretch."""
        end = int(place[-1] + size[-1]) if len(place) else 0
        if end <= len(data):
            self._rest = data[end:]
        else:
            begin = int(place[-1])
            kind = int.from_bytes(data[begin + 12 : begin + 16], "little")
            if end - begin <= FRAME_BYTES:
                self._rest = data[begin:]
            elif kind in FRAMES:
                raise LogError(
                    f"{origin}: the object at byte {begin}, of type {kind}, has {end - begin} bytes"
                )
            else:
                self._found.passed[OTHERS.get(kind, f"objects of type {kind}")] += 1
                self._rest, self._skip = b"", end - len(data)
        self._before += len(data) - len(self._rest)

    def close(self) -> None:
        """Tell what is left."""
        if (self._rest.strip(b"\0") or self._skip) and not self._found.remarks:
            missing = self._skip or int.from_bytes(self._rest[8:12], "little") - len(self._rest)
            known = len(self._rest) >= BASE_BYTES or self._skip
            self._found.remarks.append(
                f"is cut short: its last object is missing {missing} bytes" if known
                else f"is cut short: {len(self._rest)} bytes of an object are left"
            )  # fmt: skip
