"""Bytes of a file from elsewhere, unpacked if packed: gzip, compress (.Z), bzip2, xz, or a zip of one file.

Recognised by content, not by name, and bounded: only regular files are opened, nothing grows beyond LARGEST
bytes, and what is packed may be packed once more, as a .gz in a zip is, not oftener.
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

_TEXT_ENDS = (b"\n", b"\r", b"\x1a", b"\0")
"""Last bytes of texts: ends of a line, MS-DOS's end of file, and what fills a block."""

_TAR_AT, _TAR = 257, b"ustar"


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


_MOST_OFTEN = 2
"""Packed oftener is no file of data."""


def unpacked(raw: bytes) -> bytes:
    """What bytes hold if they are packed in one of the ways known, else themselves."""
    for _ in range(_MOST_OFTEN):
        inner = _unpacked_once(raw)
        if inner is raw:
            break
        raw = inner
    else:
        if any(raw.startswith(start) for start, _, _ in _PACKERS):
            raise PackedError(f"is packed more than {_MOST_OFTEN} times")
    if raw[_TAR_AT : _TAR_AT + len(_TAR)] == _TAR:
        raise PackedError("tar archive is not read; unpack the file of it")
    return raw


def _unpacked_once(raw: bytes) -> bytes:
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
    return _streams(raw, bz2.BZ2Decompressor)


def _unxz(raw: bytes) -> bytes:
    """No stream may have a dictionary beyond reason."""
    return _streams(raw, lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_XZ_MEMORY))


def _streams(raw: bytes, new: Callable[[], bz2.BZ2Decompressor | lzma.LZMADecompressor]) -> bytes:
    """All streams of a file, one behind the other, and nothing behind them: what does not begin as a stream
    may be one that is damaged, which the library's own reader of files would leave out."""
    data = b""
    while raw.strip(b"\0"):
        stream = new()
        data = _bounded(data + stream.decompress(raw, LARGEST + 1 - len(data)))
        if not stream.eof:
            raise EOFError
        raw = stream.unused_data
    return data


def _uncompress(raw: bytes) -> bytes:
    data = lzw.expanded(raw, LARGEST)
    if data is None:
        raise _too_much()
    # The format has neither a length nor a sum; but a text of a program ends with its last line.
    if data and data[-1:] not in _TEXT_ENDS:
        raise PackedError("compress (.Z) data is cut off: its text ends within a line")
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
    """Folders, and what a Mac or Windows puts beside files."""
    name = member.filename
    return member.is_dir() or name.startswith("__MACOSX/") or name.rpartition("/")[2].lower() in _CLUTTER


_CLUTTER = (".ds_store", "thumbs.db", "desktop.ini")


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
    (b"\x5d\0\0", "lzma", None),
    (b"\x1f\xa0", "compress -H", None),
    (b"\x1f\x1e", "pack", None),
)
"""First bytes, name, and how it is unpacked; None where it is not."""
