"""One line for each frame, for pipes and files; written by a thread of its own.

The reader of the lines may be slow, and an embedded bus waits for every peer. So the bus is always read;
lines for which there is no room are left out, and a line has their number.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.monitor.format import Formatter, identifier
from gnss_hil.tools.recording.formats.candump import format_lines

ROOM_FRAMES = 1 << 16
"""Frames that may wait to be written."""


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Frames (n,) with their checks (n,), heard at a UNIX time; how many were left out before."""

    unix_us: int
    frames: FrameBatch
    verdict: NDArray[np.uint8]
    left_out: int = 0


class Decoded:
    """'(1351642484.000111) 100 RX1_RANGE channel=3 pseudorange_m=21345678.9012 [LOST]'."""

    def __init__(self, formatter: Formatter):
        self._formatter = formatter

    def __call__(self, piece: Piece) -> bytes:
        stamp = f"({piece.unix_us // 1_000_000}.{piece.unix_us % 1_000_000:06d})"
        values = self._formatter.values(piece.frames, piece.verdict)
        lines = [
            f"{stamp} {identifier(can_id)} {self._formatter.name(can_id)} {text}"
            + (f" [{Verdict(verdict).name}]" if verdict else "")
            for can_id, text, verdict in zip(
                piece.frames.can_id.tolist(), values, piece.verdict.tolist(), strict=True
            )
        ]
        return "".join(f"{line}\n" for line in lines).encode("ascii")


class Raw:
    """candump's log format, for can-utils to read."""

    def __init__(self, bus: str):
        self._bus = bus

    def __call__(self, piece: Piece) -> bytes:
        return format_lines(np.full(len(piece.frames), piece.unix_us), piece.frames, self._bus)


class Printer:
    """Writes pieces to a file descriptor from its own thread.

    failure   what writing raised: the reader left, the disk is full
    left_out  frames for which there was no room, all in all
    """

    def __init__(self, descriptor: int, text):
        self._descriptor, self._text = descriptor, text
        self._pieces: deque[Piece] = deque()
        self._change = threading.Condition()
        self._waiting = self._left_out = self.left_out = 0
        self._over = False
        self.failure: OSError | None = None
        self._thread = threading.Thread(target=self._write, name="printer", daemon=True)
        self._thread.start()

    def put(self, unix_us: int, frames: FrameBatch, verdict: NDArray[np.uint8]) -> None:
        """Never waits."""
        with self._change:
            if self._waiting + len(frames) > ROOM_FRAMES:
                self._left_out += len(frames)
                self.left_out += len(frames)
                return
            self._pieces.append(Piece(unix_us, frames, verdict, self._left_out))
            self._left_out = 0
            self._waiting += len(frames)
            self._change.notify()

    def close(self, patience_s: float) -> None:
        """Writes what waits, but no longer than `patience_s`: the reader may have stopped."""
        with self._change:
            self._over = True
            self._change.notify()
        self._thread.join(patience_s)

    def _next(self) -> tuple[Piece | None, int]:
        """What to write next, and how many frames to say were left out before it; (None, 0) at the end."""
        with self._change:
            while not (self._pieces or self._left_out or self._over):
                self._change.wait()
            if self._pieces:
                piece = self._pieces.popleft()
                self._waiting -= len(piece.frames)
                return piece, piece.left_out
            left_out, self._left_out = self._left_out, 0
            return None, left_out

    def _write(self) -> None:
        try:
            while any(following := self._next()):
                piece, left_out = following
                self._all(_gap(left_out) + (self._text(piece) if piece else b""))
        except OSError as error:
            self.failure = error

    def _all(self, text: bytes) -> None:
        while text:
            text = text[os.write(self._descriptor, text) :]


def _gap(left_out: int) -> bytes:
    many = so_many(left_out, "frame")
    return f"# {many} not shown: the reader of this is too slow\n".encode() if left_out else b""
