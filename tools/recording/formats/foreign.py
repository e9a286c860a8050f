"""Recordings through python-can: its readers, with what this bench expects where a file is damaged, its
messages as pieces of a recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import can
import numpy as np

from gnss_hil.dbc.bus.pythoncan import from_messages
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, SFF_MASK, WIDTH, FrameBatch
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.formats.piece import CUT, FD, Findings, LogError, Piece


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


def open_mf4(path: Path) -> Reading:
    """Frames of an MF4 file."""
    from gnss_hil.tools.recording.formats.mf4 import open_reader

    return Reading(open_reader(path))


def read_mf4(path: Path, found: Findings) -> Iterator[Piece]:
    """Pieces of an MF4 file."""
    return _read(path, found, open_mf4, "ASAM MDF 4")


def _read(path: Path, found: Findings, opening: Callable[[Path], Reading], what: str) -> Iterator[Piece]:
    read, size = 0, max(path.stat().st_size, 1)
    try:
        opened = opening(path)
        try:
            for piece in pieces_of(opened.messages, str(path), found.omitted):
                at = opened.tell()
                found.share = None if at is None else at / size
                read += len(piece.unix_us)
                yield piece
            if complaint := opened.complaint():
                found.remarks.append(complaint)
        finally:
            with suppress(Exception):  # of a damaged file: the fault is reported already
                opened.messages.stop()
    except (LogError, OSError, MemoryError, Mistake):
        raise
    except Exception as error:  # whatever a foreign parser makes of a damaged file
        fault = " ".join(str(error).split()) or type(error).__name__
        where = f"damaged after {read} frames or more"
        raise LogError(f"{path}: not {what}, or {where}: {fault}") from None


MESSAGES = 1 << 14
"""Messages in a piece."""

_LATEST_S = 1e11
"""No recording is from later (the year 5138): such a time is damage."""


def pieces_of(messages: Iterable[can.Message], origin: str, omitted: Counter[str]) -> Iterator[Piece]:
    """Pieces of a recording that python-can reads; channel n is the bus `can{n}`.

    CAN FD frames, and those with less data than they announce, are counted and left out.
    """
    messages = iter(messages)
    while chunk := list(islice(messages, MESSAGES)):
        classical = [m for m in chunk if not m.is_fd]
        whole = [m for m in classical if len(m.data) >= min(m.dlc, WIDTH) or m.is_remote_frame]
        omitted.update({FD: len(chunk) - len(classical), CUT: len(classical) - len(whole)})
        yield _piece(whole, origin)


def _piece(messages: list[can.Message], origin: str) -> Piece:
    stamps_s = np.array([m.timestamp for m in messages], float)
    sane = (stamps_s >= 0) & (stamps_s < _LATEST_S)
    if not sane.all():
        raise LogError(f"{origin}: is damaged: a frame at {stamps_s[~sane][0]:g} s")
    frames = from_messages(messages)
    identifier = frames.can_id & EFF_MASK
    wrong = (identifier > SFF_MASK) & (frames.can_id & (EFF_FLAG | ERR_FLAG) == 0)
    if wrong.any():
        raise LogError(f"{origin}: is damaged: base frame with identifier {identifier[wrong][0]:X}")
    length = np.minimum(frames.length, WIDTH)  # DLC 9 to 15 of a classical frame means eight bytes
    frames = FrameBatch(frames.t_ns, frames.can_id, length, frames.data)
    bus = np.array([_name(m.channel) for m in messages], "S15")
    sent = np.array([not m.is_rx for m in messages], bool)
    return Piece(np.rint(stamps_s * 1e6).astype(np.int64), bus, frames, sent)


def _name(channel: object) -> str:
    return f"can{max(channel, 0)}" if isinstance(channel, int) else str(channel or "can0")
