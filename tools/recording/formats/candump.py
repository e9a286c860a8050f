"""The candump log format (`candump -l`), whole batches at a time.

    (1351642484.000111) can0 101#8A000304050607FF

Source: can-utils, lib.c (`snprintf_canframe`) and asc/log conventions of `candump -l`: seconds since the
UNIX epoch with six decimals, interface, identifier of three (base) or eight (extended, error) hexadecimal
digits, `#`, payload; a remote frame has `R` and its length instead of a payload. `candump -x` adds the
direction, `R` or `T`: a `T` is written behind frames that were sent, nothing behind others. CAN FD frames
(`##`) can be recognised, not represented. Lines may end in CR LF, as logs do that passed through Windows.
"""

from __future__ import annotations

import codecs
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import (
    EFF_FLAG,
    EFF_MASK,
    ERR_FLAG,
    RTR_FLAG,
    SFF_MASK,
    WIDTH,
    FrameBatch,
)
from gnss_hil.tools.recording.formats.piece import CUT, FD, NAME_BYTES, XL, Findings, LogError, Piece

_DIGITS3 = np.array([f"{i:03d}".encode() for i in range(1000)])
_ID3 = np.array([f"{i:03X}".encode() for i in range(SFF_MASK + 1)])
_HEX2 = np.array([f"{i:02X}".encode() for i in range(256)]).view("<u2")
_STAMP = ("s9", "s6", "s3", "s0", "us3", "us0")
_MARKS = (("open", b"("), ("point", b"."), ("close", b") "), ("hash", b"#"))
_NIBBLE = np.full(256, -1, np.int16)  # value of a hexadecimal digit
_NIBBLE[list(b"0123456789ABCDEF")] = range(16)
_NIBBLE[list(b"abcdef")] = range(10, 16)
_DIGIT = np.where(_NIBBLE < 10, _NIBBLE, -1).astype(np.int16)
_OCTET = (
    np.where(  # value of two digits, by their characters as a little-endian word
        np.minimum(_NIBBLE[None, :], _NIBBLE[:, None]) < 0, -1, _NIBBLE[None, :] << 4 | _NIBBLE[:, None]
    )
    .astype(np.int16)
    .ravel()
)
LINE_BYTES = 1 << 16
"""No line of a log is longer."""

_HEAD_BYTES = 4096

_LINE = re.compile(
    rb"\((\d{1,12})\.(\d{6,9})\) (\S{1,15}) ([0-7][0-9A-Fa-f]{2}|[0-9A-Fa-f]{8})#"
    rb"(?:(R)([0-8]?)|((?:[0-9A-Fa-f]{2}){0,8}))(?:(?<=R8)_[9A-Fa-f]|(?<=[0-9A-Fa-f]{16})_[9A-Fa-f])?"
)
"""Behind eight bytes there may be the length code of a classical frame that said more than eight."""
_FULL = re.compile(
    rb"\(\d{1,12}\.\d{6,9}\) \S{1,15} ([0-7][0-9A-Fa-f]{2}|[0-9A-Fa-f]{8})#[0-9A-Fa-f]{16}( [RT])?"
)
"""A frame that is whole without the end of its line: no payload has more bytes."""

_LONGER = {
    FD: re.compile(rb"\(\d+\.\d{6,9}\) \S{1,15} (?:[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})##[0-9A-Fa-f]+"),
    XL: re.compile(
        rb"\(\d+\.\d{6,9}\) \S{1,15} [0-9A-Fa-f]{3,5}#(?:[0-9A-Fa-f]{2}:){2}[0-9A-Fa-f]{8}#[0-9A-Fa-f]*"
    ),
}
"""Frames that are none of classical CAN."""


def format_lines(unix_us: NDArray[np.int64], frames: FrameBatch, bus: str) -> bytes:
    """Log text of frames (n,) stamped with UNIX times (n,) [us], one line each."""
    if (frames.can_id <= SFF_MASK).all() and (frames.length == WIDTH).all():
        return _records(unix_us, frames, bus).tobytes()
    rows = (unix_us, frames.can_id, frames.length, frames.data)
    return "".join(_line(bus, *row) for row in zip(*(c.tolist() for c in rows), strict=True)).encode()


def _line(bus: str, unix_us: int, can_id: int, length: int, data: list[int]) -> str:
    """Any frame."""
    second, micro = divmod(unix_us, 1_000_000)
    digits = 8 if can_id & (EFF_FLAG | ERR_FLAG) else 3
    payload = f"R{length}" if can_id & RTR_FLAG else bytes(data[:length]).hex().upper()
    return f"({second:010d}.{micro:06d}) {bus} {can_id & (EFF_MASK | ERR_FLAG):0{digits}X}#{payload}\n"


def _records(unix_us: NDArray[np.int64], frames: FrameBatch, bus: str) -> NDArray:
    """(n,) packed records, one line each, of base frames of eight bytes."""
    lines = np.empty(len(frames), _line_type(len(bus)))
    second, micro = np.divmod(unix_us, 1_000_000)
    for name, mark in (*_MARKS, ("newline", b"\n")):
        lines[name] = mark
    billion, rest = np.divmod(second, 1_000_000_000)
    lines["s9"] = billion + ord("0")
    for name, value in (("s6", rest // 1_000_000), ("s3", rest // 1000 % 1000), ("s0", rest % 1000)):
        lines[name] = _DIGITS3.take(value)
    lines["us3"] = _DIGITS3.take(micro // 1000)
    lines["us0"] = _DIGITS3.take(micro % 1000)
    lines["bus"] = f"{bus} ".encode()
    lines["id"] = _ID3.take(frames.can_id)
    lines["data"] = _HEX2.take(frames.data).view("S16")[:, 0]
    return lines


@cache
def _line_type(bus_characters: int) -> np.dtype:
    fields = {
        "open": "S1", "s9": "u1", "s6": "S3", "s3": "S3", "s0": "S3", "point": "S1", "us3": "S3", "us0": "S3",
        "close": "S2", "bus": f"S{bus_characters + 1}", "id": "S3", "hash": "S1", "data": "S16",
        "newline": "S1",
    }  # fmt: skip
    return np.dtype(list(fields.items()))


def parse_lines(text: bytes, origin: str = "log", omitted: Counter[str] | None = None) -> Piece:
    """The frames of whole lines of log text.

    LogError names the first line that is none. CAN FD frames are errors too, unless `omitted` counts them.
    """
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n")
    raw = np.frombuffer(text, np.uint8)
    ends = np.flatnonzero(raw == ord("\n"))
    n = len(ends)
    unix_us, bus, sent = np.zeros(n, np.int64), np.zeros(n, f"S{NAME_BYTES}"), np.zeros(n, bool)
    frames = FrameBatch(np.zeros(n, np.int64), np.zeros(n, np.uint32), np.full(n, WIDTH, np.uint8),
                        np.zeros((n, WIDTH), np.uint8))  # fmt: skip
    if not n:
        return Piece(unix_us, bus, frames, sent)
    starts = np.r_[0, ends[:-1] + 1]
    marked = (ends - starts >= 2) & (raw[ends - 2] == ord(" ")) & np.isin(raw[ends - 1], list(b"RT"))
    sent[:] = marked & (raw[ends - 1] == ord("T"))
    ends = ends - 2 * marked
    lengths = ends - starts
    width = int(np.bincount(lengths).argmax())
    name_length = width - len("(1351642484.000111)  123#0011223344556677")
    usual = lengths == width if 0 < name_length <= NAME_BYTES else np.zeros(n, bool)
    if usual.any():
        kind = _line_type(name_length)
        if usual.all() and not marked.any():
            lines = raw.view(kind)
        else:
            lines = raw[starts[usual, None] + np.arange(width + 1)].view(kind)[:, 0]
        good = _parse_records(lines, np.flatnonzero(usual), unix_us, bus, frames)
        usual[np.flatnonzero(usual)[~good]] = False
    left_out = np.zeros(n, bool)
    for i in np.flatnonzero(~usual):
        line = text[starts[i] : ends[i]]
        if omitted is not None:
            line = b" ".join(line.replace(codecs.BOM_UTF8, b"").split())  # as mail and editors leave them
            if line[-2:] in (b" T", b" R"):
                sent[i], line = line[-1:] == b"T", line[:-2]
            longer = _longer(line)
            left_out[i] = longer is not None or not line or line.startswith(b"#")
            if longer is not None:
                omitted[longer] += 1
            if left_out[i]:
                continue
        unix_us[i], bus[i], frames.can_id[i], frames.length[i], payload = _parse_line(
            line, f"{origin}: line {i + 1}"
        )
        frames.data[i] = list(payload.ljust(WIDTH, b"\0"))
    piece = Piece(unix_us, bus, frames, sent)
    return piece.rows(~left_out) if left_out.any() else piece


def _parse_records(lines: NDArray, rows: NDArray, unix_us, bus, frames: FrameBatch) -> NDArray[np.bool_]:
    """Fill the rows from packed lines (k,) of base frames of eight bytes; (k,) whether a line is one."""
    digits = [_DIGIT.take(column) for name in _STAMP for column in _columns(lines, name)]
    stamp = np.zeros(len(lines), np.int64)
    for digit in digits:
        stamp *= 10
        stamp += digit
    nibbles = [_NIBBLE.take(column) for column in _columns(lines, "id")]
    octets = _OCTET.take(np.ascontiguousarray(lines["data"]).view("<u2").reshape(-1, WIDTH))
    good = octets.min(axis=1) >= 0
    for value in (*digits, *nibbles):
        good &= value >= 0
    good &= nibbles[0] < 8
    *name, gap = _columns(lines, "bus")
    good &= gap == ord(" ")
    for value in name:  # an extended identifier of a bus with a shorter name is as long
        good &= value > ord(" ")
    for name, mark in _MARKS:
        good &= lines[name] == mark
    unix_us[rows] = stamp
    bus[rows] = lines["bus"].astype(f"S{lines['bus'].dtype.itemsize - 1}")
    frames.can_id[rows] = (nibbles[0].astype(np.int32) << 8) + (nibbles[1] << 4) + nibbles[2]
    frames.data[rows] = octets.astype(np.uint8)
    return good


def _columns(lines: NDArray, name: str) -> list[NDArray[np.uint8]]:
    """The characters of a field, (k,) each."""
    field = np.ascontiguousarray(lines[name])
    return list(np.ascontiguousarray(field.view(np.uint8).reshape(len(lines), -1).T))


def _longer(line: bytes) -> str | None:
    """Which newer kind of CAN a line has a frame of, None if it has none."""
    return next((kind for kind, pattern in _LONGER.items() if b"#" in line and pattern.fullmatch(line)), None)


def _parse_line(line: bytes, where: str) -> tuple[int, bytes, int, int, bytes]:
    match = _LINE.fullmatch(line)
    if match is None and (kind := _longer(line)):
        raise LogError(f"{where}: a {kind} frame; this bench's are classical")
    if match is None:
        raise LogError(f"{where}: not a candump line: {line[:60].decode('ascii', 'replace')!r}")
    second, fraction, bus, digits, remote, count, payload = match.groups()
    unix_us = (int(second) * 10**9 + int(fraction.ljust(9, b"0")) + 500) // 1000
    can_id = int(digits, 16)
    if len(digits) == 8 and not can_id & ERR_FLAG:
        can_id |= EFF_FLAG
    if remote:
        return unix_us, bus, can_id | RTR_FLAG, int(count or 0), b""
    octets = bytes.fromhex(payload.decode())
    return unix_us, bus, can_id, len(octets), octets


def read_chunks(
    log: BinaryIO, origin: str, chunk_bytes: int = 1 << 21, omitted: Counter[str] | None = None
) -> Iterator[Piece]:
    """Parsed pieces of a log of any size; a last line cut short (a crash) is left out, a byte order mark at
    the start is read over."""
    rest, lines, start = b"", 0, True
    while piece := log.read(chunk_bytes):
        whole, newline, rest = (rest + piece).rpartition(b"\n")
        if start and newline:
            whole, start = whole.removeprefix(codecs.BOM_UTF8), False
        if len(rest) > LINE_BYTES:
            raise LogError(f"{origin}: not a candump log: line {lines + 1} has no end")
        if newline:
            text = whole + newline
            yield parse_lines(text, f"{origin} (after line {lines})" if lines else origin, omitted)
            lines += text.count(b"\n")
    rest = rest.strip(b" \t\r\x1a")  # MS-DOS ends text with a control Z
    if rest and omitted is not None:
        if _FULL.fullmatch(rest):
            yield parse_lines(rest + b"\n", f"{origin} (after line {lines})", omitted)
        else:
            omitted[CUT] += 1


def read(path: Path, found: Findings) -> Iterator[Piece]:
    """The frames of a log; LogError names the first line that is none."""
    with path.open("rb") as log:
        head = log.read(_HEAD_BYTES)
        if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            raise LogError(f"{path}: is UTF-16 text; save it as UTF-8")
        if b"\r" in head and b"\n" not in head:
            raise LogError(f"{path}: lines end in CR alone; CR LF and LF are read")
        log.seek(0)
        size = max(os.fstat(log.fileno()).st_size, 1)
        for piece in read_chunks(log, str(path), omitted=found.omitted):
            found.share = log.tell() / size
            yield piece


class CandumpWriter:
    """Text of `candump -l`."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        self._file = path.open("wb")

    def write(self, piece: Piece) -> None:
        unix_us, bus, frames, sent = piece
        names = np.unique(bus).tolist()
        if len(names) == 1 and not sent.any():
            self._file.write(format_lines(unix_us, frames, names[0].decode()))
            return
        lines = np.empty(len(frames), object)
        for name in names:
            mine = bus == name
            text = format_lines(unix_us[mine], frames[mine], name.decode())
            lines[mine] = text.splitlines(keepends=True)
        lines[sent] = [line[:-1] + b" T\n" for line in lines[sent]]
        self._file.write(b"".join(lines))

    def close(self) -> None:
        self._file.close()
