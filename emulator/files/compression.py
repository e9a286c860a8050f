"""Bytes of a file from elsewhere, unpacked if packed: gzip, compress (.Z), bzip2, xz, or a zip of one file.

Recognised by content, not by name, and bounded: only regular files are opened, and nothing grows beyond
LARGEST bytes.
Sources: RFC 1952 (gzip); bzip2; the .xz file format 1.2; PKWARE APPNOTE 6.3 (zip)
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import stat
import zipfile
import zlib
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from gnss_hil.emulator.files import lzw

LARGEST = 512 << 20
"""Bytes of a file, and of what is unpacked of it."""

_XZ_MEMORY = 256 << 20


class PackedError(ValueError):
    """Bytes that cannot be had; the message is for people, without the file's name."""


def read_bytes(path: Path) -> bytes:
    """What a regular file holds, unpacked; PackedError if that cannot be had."""
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise PackedError("Is a directory")
        if not stat.S_ISREG(status.st_mode):
            raise PackedError("not a regular file")
        if status.st_size > LARGEST:
            raise PackedError(f"file has {status.st_size >> 20} MB; up to {LARGEST >> 20} are read")
        raw = path.read_bytes()
    except OSError as error:
        raise PackedError(error.strerror or "cannot be read") from None
    return unpacked(raw)


def unpacked(raw: bytes) -> bytes:
    """What bytes hold if they are packed in one of the ways known, else themselves."""
    for start, name, unpack in _PACKERS:
        if raw.startswith(start):
            if unpack is None:
                raise PackedError(f"{name} is not read; unpack it, or pack it as .gz")
            try:
                return unpack(raw)
            except (EOFError, OSError, ValueError, zlib.error, lzma.LZMAError, zipfile.BadZipFile) as error:
                if isinstance(error, PackedError):
                    raise
                raise PackedError(f"{name} data is cut off or damaged") from None
    return raw


def _too_much() -> PackedError:
    return PackedError(f"unpacked it has more than {LARGEST >> 20} MB, the most that is read")


def _bounded(data: bytes) -> bytes:
    if len(data) > LARGEST:
        raise _too_much()
    return data


def _gunzip(raw: bytes) -> bytes:
    with gzip.open(BytesIO(raw)) as stream:
        return _bounded(stream.read(LARGEST + 1))


def _bunzip(raw: bytes) -> bytes:
    with bz2.open(BytesIO(raw)) as stream:
        return _bounded(stream.read(LARGEST + 1))


def _unxz(raw: bytes) -> bytes:
    """All streams of a file, none with a dictionary beyond reason."""
    data = b""
    while raw.strip(b"\0"):
        stream = lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_XZ_MEMORY)
        data = _bounded(data + stream.decompress(raw, LARGEST + 1 - len(data)))
        if not stream.eof:
            raise EOFError
        raw = stream.unused_data
    return data


def _uncompress(raw: bytes) -> bytes:
    data = lzw.expanded(raw, LARGEST)
    if data is None:
        raise _too_much()
    return data


def _unzip(raw: bytes) -> bytes:
    with zipfile.ZipFile(BytesIO(raw)) as archive:
        members = [member for member in archive.infolist() if not _is_clutter(member)]
        if len(members) != 1:
            raise PackedError(f"zip holds {len(members)} files; one is read")
        if members[0].flag_bits & 1:
            raise PackedError("zip is encrypted")
        try:
            with archive.open(members[0]) as stream:
                return _bounded(stream.read(LARGEST + 1))
        except NotImplementedError:
            raise PackedError("zip is packed in a way that is not read") from None


def _is_clutter(member: zipfile.ZipInfo) -> bool:
    """Folders, and what a Mac puts beside each file."""
    return member.is_dir() or member.filename.startswith("__MACOSX/")


_PACKERS: tuple[tuple[bytes, str, Callable[[bytes], bytes] | None], ...] = (
    (b"\x1f\x8b", "gzip", _gunzip),
    (lzw.START, "compress (.Z)", _uncompress),
    (b"BZh", "bzip2", _bunzip),
    (b"\xfd7zXZ\0", "xz", _unxz),
    (b"PK\3\4", "zip", _unzip),
    (b"PK\5\6", "zip", _unzip),
    (b"\x28\xb5\x2f\xfd", "zstd", None),
    (b"7z\xbc\xaf\x27\x1c", "7z", None),
    (b"Rar!", "rar", None),
    (b"\x04\x22\x4d\x18", "lz4", None),
    (b"\x1f\xa0", "compress -H", None),
    (b"\x1f\x1e", "pack", None),
)
"""First bytes, name, and how it is unpacked; None where it is not."""
