"""Messages that python-can writes or has read, and pieces of a recording, as rows that can be compared."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import can

from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG
from gnss_hil.tools.recording.formats.order import joined
from gnss_hil.tools.recording.formats.piece import Findings, Piece

Row = tuple[int, str, str, bool]
"""Microseconds, bus, identifier#data, whether it was sent."""


def read_whole(
    read: Callable[[Path, Findings], Iterable[Piece]], path: Path, octets: bytes
) -> tuple[Piece | None, Findings]:
    """All that a reader makes of a file of these bytes."""
    found = Findings()
    path.write_bytes(octets)
    pieces = list(read(path, found))
    return (joined(pieces) if pieces else None), found


def drawn(start_s: float, n: int, seed: int = 3, sent_errors: bool = False) -> list[can.Message]:
    """Messages of every kind, a millisecond apart; error frames are never sent, or may be."""
    rng = random.Random(seed)
    messages = []
    for i in range(n):
        extended, remote, fd, sent, error = (rng.random() < p for p in (0.3, 0.1, 0.2, 0.3, 0.05))
        data = b"" if remote and not error else rng.randbytes(rng.randrange(9))
        messages.append(can.Message(
            start_s + i * 0.001, rng.randrange(2**29 if extended else 2**11), extended,
            remote and not error, error, rng.randrange(3), len(data), data,
            fd and not remote and not error, not sent or (error and not sent_errors),
        ))  # fmt: skip
    return messages


def hexes(piece: Piece) -> list[str]:
    """Identifier with its flags, and payload, of each frame."""
    return [f"{i:X}#{bytes(d[:n]).hex().upper()}" for i, n, d in
            zip(piece.frames.can_id, piece.frames.length, piece.frames.data, strict=True)]  # fmt: skip


def rows_of_piece(piece: Piece, since_us: int = 0) -> list[Row]:
    buses = [name.decode() for name in piece.bus.tolist()]
    times = (piece.unix_us - since_us).tolist()
    return list(zip(times, buses, hexes(piece), piece.sent.tolist(), strict=True))


def rows_of_messages(messages: Sequence[can.Message], since_us: int = 0) -> list[Row]:
    rows = []
    for m in messages:
        flags = EFF_FLAG * m.is_extended_id | RTR_FLAG * m.is_remote_frame | ERR_FLAG * m.is_error_frame
        data = bytes(m.dlc) if m.is_remote_frame else bytes(m.data)
        name = f"{m.arbitration_id | flags:X}#{data.hex().upper()}"
        rows.append((round(m.timestamp * 1e6) - since_us, f"can{m.channel}", name, not m.is_rx))
    return rows
