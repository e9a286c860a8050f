"""Frames of an ASC file at their absolute times."""

from __future__ import annotations

import codecs
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.tools.recording.formats.asc.events import UNKNOWN, Event, Omitted, event, time_ns
from gnss_hil.tools.recording.formats.asc.header import Header
from gnss_hil.tools.recording.formats.asc.lines import MOST_S, Lines, parse
from gnss_hil.tools.recording.formats.piece import Findings, LogError, Piece, sound

CHUNK_BYTES = 1 << 21
LINE_BYTES = 1 << 16
"""No line is longer."""
_HEAD_BYTES = 4096
_CUTS = re.compile(rb"(?:\A|(?<=\n))([ \t]*(?:(begin[ \t]+triggerblock)|base[ \t])[^\n]*\n)", re.IGNORECASE)
_HEADED = re.compile(rb"(base|date)[ \t]")
_NEAR_NS = 120 * 10**9


def read(path: Path, found: Findings) -> Iterator[Piece]:
    """The frames of a file; LogError if it is none."""
    with path.open("rb") as file:
        size = max(os.fstat(file.fileno()).st_size, 1)
        head = file.read(_HEAD_BYTES).lower()
        if head.startswith((codecs.BOM_UTF16_LE.lower(), codecs.BOM_UTF16_BE.lower())):
            raise LogError(f"{path}: is UTF-16 text; save it as UTF-8")
        if b"\r" in head and b"\n" not in head:
            raise LogError(f"{path}: lines end in CR alone; CR LF and LF are read")
        if not _HEADED.search(head):
            raise LogError(f"{path}: not Vector ASC: neither a date nor a base line")
        file.seek(len(codecs.BOM_UTF8) if head.startswith(codecs.BOM_UTF8.lower()) else 0)
        reader, rest = _Reader(str(path), found), b""
        while chunk := file.read(CHUNK_BYTES):
            whole, newline, rest = (rest + chunk).rpartition(b"\n")
            if newline:
                for text in _blocks(whole + newline):
                    yield reader.take(text)
            if len(rest) > LINE_BYTES:
                raise LogError(f"{path}: not Vector ASC: line {reader.lines + 1} has no end")
            found.share = file.tell() / size
        if reader.has_all_of(rest):
            yield reader.take(rest + b"\n")
        elif time_ns(rest) is not None:
            found.remarks.append("is cut short in its last line, which is left out")
        reader.close()


def _blocks(text: bytes) -> Iterator[bytes]:
    """The text, cut before each line that begins a block and behind each that tells a base."""
    begin, small = 0, text.lower()
    rare = b"triggerblock" in small or b"base" in small  # the pattern takes longer than all else
    for match in _CUTS.finditer(text) if rare else ():
        at = match.start(1) if match[2] else match.end(1)
        if at > begin:
            yield text[begin:at]
            begin = at
    if begin < len(text):
        yield text[begin:]


class _Reader:
    """What has to be kept from one chunk to the next.

    lines     taken so far
    start_ns  UNIX time from which times count; None until the first event tells which date they count from
    before_ns of the event before, of which relative times count
    """

    def __init__(self, origin: str, found: Findings):
        self._origin = origin
        self._found = found
        self._header = Header()
        self._start_ns: int | None = None
        self._before_ns = 0
        self._unknown = ""
        self.lines = 0

    def has_all_of(self, line: bytes) -> bool:
        """Whether a line without an end holds a whole frame of data: every byte, the last one not cut."""
        words = line.split()
        if time_ns(line) is None or len(words) < 6 or words[4].lower() != b"d" or not words[5].isdigit():
            return False
        behind = len(words) - 6 - min(int(words[5]), WIDTH)
        return behind > 0 or (behind == 0 < int(words[5]) and self._header.base == 16 and len(words[-1]) == 2)

    def take(self, text: bytes) -> Piece:
        """The frames of whole lines, all with the same base."""
        lines = parse(text, self._header.base)
        framed, timed = lines.framed, lines.framed.copy()
        for i in np.flatnonzero(~framed).tolist():
            line = text[lines.begin[i] : lines.end[i]]
            t_ns = time_ns(line)
            if t_ns is None:
                self._note(self._header.hear(_text(line)), i, line)
                continue
            timed[i], lines.t_ns[i] = True, t_ns
            rest = _text(line).split(None, 1)
            self._hear(lines, i, event(rest[1] if len(rest) > 1 else "", self._header.base), line)
        self.lines += len(framed)
        return self._piece(lines, timed)

    def _hear(self, lines: Lines, i: int, heard: Event, line: bytes) -> None:
        if isinstance(heard, str):
            self._note(heard, i, line)
        elif isinstance(heard, Omitted):
            self._found.omitted[heard.why] += 1
        else:
            lines.framed[i] = True
            lines.channel[i], lines.can_id[i], lines.sent[i] = max(heard.channel, 0), heard.can_id, heard.sent
            lines.length[i] = heard.length
            lines.data[i] = np.frombuffer(heard.data[:WIDTH].ljust(WIDTH, b"\0"), np.uint8)

    def _note(self, kind: str | None, i: int, line: bytes) -> None:
        """Count a line that is no frame."""
        kind = UNKNOWN if kind is None else kind
        if not kind:
            return
        self._found.passed[kind] += 1
        if kind == UNKNOWN and not self._unknown:
            self._unknown = f"line {self.lines + i + 1} is not known: {_text(line).strip()[:60]!r}"

    def _piece(self, lines: Lines, timed: np.ndarray) -> Piece:
        t_ns = lines.t_ns
        if timed.any():
            self._begin(int(t_ns[timed][0]))
            if self._header.relative:
                if abs(reached_s := (self._before_ns + t_ns[timed].sum(dtype=float)) / 1e9) > MOST_S:
                    raise LogError(f"{self._origin}: is damaged: relative times amount to {reached_s:g} s")
                t_ns[timed] = self._before_ns + np.cumsum(t_ns[timed])
                self._before_ns = int(t_ns[timed][-1])
        rows = np.flatnonzero(lines.framed)
        unix_us = (t_ns[rows] + (self._start_ns or 0) + 500) // 1000
        frames = FrameBatch(
            np.zeros(len(rows), np.int64), lines.can_id[rows], lines.length[rows], lines.data[rows]
        )
        omitted = self._found.omitted
        return sound(unix_us, lines.channel[rows], frames, lines.sent[rows], self._origin, omitted)

    def _begin(self, first_ns: int) -> None:
        """Which instant the times of a block count from, told by its first one.

        A block that begins at zero has a clock of its own, which began at its date; one that begins later was
        triggered later, and its times count from the date of the file, as CANoe has it. Programs whose base
        line has no `timestamps` (BUSMASTER) write the time of day where it fits the date.
        """
        header = self._header
        block, header.block = header.block, None
        anew = first_ns == 0 and not (header.relative and self._start_ns is not None)
        if block is not None and (anew or (header.date is None and self._start_ns is None)):
            self._start_ns = block.unix_ns
            self._before_ns = 0
        elif self._start_ns is None:
            date = header.date
            self._start_ns = 0 if date is None else date.unix_ns
            near = date is not None and abs(first_ns - date.of_day_ns) < _NEAR_NS < first_ns
            if date is not None and near and not header.stamps:
                self._start_ns -= date.of_day_ns
                self._found.remarks.append("has times of day, which are counted from midnight")

    def close(self) -> None:
        """Tell what is to be told once."""
        if self._header.odd_date:
            self._found.remarks.append(f"date {self._header.odd_date[:40]!r} is not understood")
        elif self._start_ns == 0:
            self._found.remarks.append("has no date: times count from 1970-01-01 UTC")
        if self._unknown:
            self._found.remarks.append(self._unknown)


def _text(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")
