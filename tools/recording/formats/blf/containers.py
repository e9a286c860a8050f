"""The uncompressed bytes of a BLF file, stretch by stretch, in bounded memory."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from typing import BinaryIO

from isal import isal_zlib

from gnss_hil.tools.recording.formats.blf.objects import BASE_BYTES, CONTAINER, MOST_GAP, SIGNATURE
from gnss_hil.tools.recording.formats.piece import Findings, LogError

STRETCH_BYTES = 1 << 22
"""What is uncompressed at a time."""
MOST_BYTES = 1 << 29
"""What a container may amount to: Vector's have 128 KiB."""

_HEADER = struct.Struct("<4s2H2L")  # signature, header's size and version, object's size, type
_CONTAINER = struct.Struct("<H6xL4x")  # compression, bytes uncompressed
_NONE, _ZLIB = 0, 2


def stretches(file: BinaryIO, begin: int, origin: str, found: Findings) -> Iterator[bytes]:
    """What is in the containers of a file and between them; objects may go on in the next stretch.

    begin  first byte behind the file's header
    """
    at = begin
    while True:
        file.seek(at)
        head = file.read(_HEADER.size + MOST_GAP)
        skip = head.find(SIGNATURE)
        if skip < 0 and not head.strip(b"\0"):
            if len(head) > MOST_GAP:
                found.remarks.append(f"ends in zeros at byte {at}")
            return
        if skip < 0:
            raise LogError(f"{origin}: is damaged: no object at byte {at}, but {head[:4].hex(' ')}")
        at += skip
        head = head[skip:].ljust(_HEADER.size, b"\0")
        _, _, _, size, kind = _HEADER.unpack_from(head)
        if at + _HEADER.size > os.fstat(file.fileno()).st_size:
            found.remarks.append(f"is cut short: the object at byte {at} is missing its size")
            return
        if size < BASE_BYTES:
            raise LogError(f"{origin}: is damaged: the object at byte {at} has a size of {size} bytes")
        file.seek(at + BASE_BYTES)
        if kind == CONTAINER:
            yield from _contents(file, at, size, origin, found)
        else:
            yield head[:BASE_BYTES]
            yield from _raw(file, at, size - BASE_BYTES, found)
        at += size


def _raw(file: BinaryIO, at: int, size: int, found: Findings) -> Iterator[bytes]:
    """The bytes from here on, as they are; told if they are not all there."""
    while size:
        part = file.read(min(size, STRETCH_BYTES))
        if not part:
            found.remarks.append(f"is cut short: the object at byte {at} is missing {size} bytes")
            return
        size -= len(part)
        yield part


def _contents(file: BinaryIO, at: int, size: int, origin: str, found: Findings) -> Iterator[bytes]:
    method, _ = _CONTAINER.unpack(file.read(_CONTAINER.size).ljust(_CONTAINER.size, b"\0"))
    parts = _raw(file, at, max(size - BASE_BYTES - _CONTAINER.size, 0), found)
    if method == _NONE:
        yield from parts
    elif method == _ZLIB:
        yield from _inflated(parts, f"{origin}: is damaged: the container at byte {at}")
    else:
        raise LogError(
            f"{origin}: the container at byte {at} has compression {method}; known are 0 and 2 (zlib)"
        )


def _inflated(parts: Iterator[bytes], where: str) -> Iterator[bytes]:
    inflate, amount = isal_zlib.decompressobj(), 0
    for part in parts:
        while part and not inflate.eof:
            try:
                stretch = inflate.decompress(part, STRETCH_BYTES)
            except isal_zlib.IsalError as error:  # pyright: ignore[reportGeneralTypeIssues]: its stub is wrong
                raise LogError(f"{where}: {error}") from None
            part, amount = inflate.unconsumed_tail, amount + len(stretch)
            if amount > MOST_BYTES:
                raise LogError(f"{where} amounts to more than {MOST_BYTES >> 20} MiB")
            yield stretch
