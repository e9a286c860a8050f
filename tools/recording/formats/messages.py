"""python-can's messages and pieces of a recording: what its readers give and its writers take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from gnss_hil.dbc.bus.pythoncan import from_messages, to_messages
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, SFF_MASK, WIDTH, FrameBatch
from gnss_hil.tools.recording.formats.candump import CUT, FD, LogError, Piece

if TYPE_CHECKING:
    import can

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
    return np.rint(stamps_s * 1e6).astype(np.int64), bus, frames


def _name(channel: object) -> str:
    return f"can{max(channel, 0)}" if isinstance(channel, int) else str(channel or "can0")


def messages_of(piece: Piece, channels: Mapping[bytes, int]) -> Iterator[can.Message]:
    """python-can messages of a piece, with its times and the numbers of its buses."""
    unix_us, bus, frames = piece
    for message, stamp_us, name in zip(to_messages(frames), unix_us.tolist(), bus.tolist(), strict=True):
        message.timestamp = stamp_us / 1e6
        message.channel = channels[name]
        yield message
