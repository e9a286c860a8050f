"""What readers and writers of recordings hand on: pieces of frames, and what was found besides."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, SFF_MASK, WIDTH, FrameBatch

NAME_BYTES = 15
"""Longest name of a bus: IFNAMSIZ less the closing zero."""

FD, XL, CUT = "CAN FD", "CAN XL", "cut short"
BEYOND = f"with an 11-bit identifier beyond {SFF_MASK:X}"
"""Why frames are left out."""

MOST_CHANNEL = 0xFFFF
_LATEST_US = 10**17
"""No recording is from later (the year 5138): such a time is damage."""


class LogError(ValueError):
    """A file that is not of its format; the message is for people."""


class Piece(NamedTuple):
    """Part of a recording.

    unix_us  (n,) int64  UNIX times [us]
    bus      (n,) bytes  names of buses
    frames   (n,)
    sent     (n,) bool   by the program that recorded them: direction Tx
    """

    unix_us: NDArray[np.int64]
    bus: NDArray[np.bytes_]
    frames: FrameBatch
    sent: NDArray[np.bool_]

    def rows(self, rows) -> Piece:
        """Some of them, by slice, mask or index array."""
        return Piece(self.unix_us[rows], self.bus[rows], self.frames[rows], self.sent[rows])


@dataclass(slots=True)
class Findings:
    """What a reading came upon besides frames.

    omitted   frames left out, by reason
    passed    what is no frame and was read over, by kind
    remarks   on the file as a whole, each for one line
    share     of the file that has been read, 0 to 1; None where that is not known
    """

    omitted: Counter[str] = field(default_factory=Counter)
    passed: Counter[str] = field(default_factory=Counter)
    remarks: list[str] = field(default_factory=list)
    share: float | None = None

    @property
    def lost(self) -> bool:
        """Whether frames that were recorded are not among those read: left out, or behind a cut."""
        return bool(+self.omitted) or any(CUT in remark for remark in self.remarks)

    def lines(self, path: Path) -> list[str]:
        """What is to be told of a file, each for one line."""
        passed = ", ".join(f"{count} {kind}" for kind, count in sorted(self.passed.items()))
        return [
            *(f"{path}: {remark}" for remark in self.remarks),
            *(f"{path}: frames left out: {count} {why}" for why, count in (+self.omitted).items()),
            *([f"{path}: no frames of CAN, read over: {passed}"] if passed else []),
        ]


def buses(channel: NDArray[np.integer]) -> NDArray[np.bytes_]:
    """(n,) names of channels (n,) from 0: channel n is the bus `can{n}`."""
    channel = np.clip(channel, 0, MOST_CHANNEL)
    if len(channel) and channel.min() == channel.max():  # one name for all rows takes no room
        return np.broadcast_to(np.array(b"can%d" % channel[0], f"S{NAME_BYTES}"), len(channel))
    names = np.zeros(int(channel.max(initial=0)) + 1, f"S{NAME_BYTES}")
    for number in np.flatnonzero(np.bincount(channel)).tolist():
        names[number] = b"can%d" % number
    return names[channel]


def kinds(frames: FrameBatch) -> Counter[str]:
    """How many of the frames are none of data."""
    error = frames.can_id & ERR_FLAG != 0
    return +Counter(error=int(error.sum()), remote=int((~error & (frames.can_id & RTR_FLAG != 0)).sum()))


def sound(
    unix_us: NDArray[np.int64], channel: NDArray[np.integer], frames: FrameBatch, sent: NDArray[np.bool_],
    origin: str, omitted: Counter[str],
) -> Piece:  # fmt: skip
    """The piece of what was read from a file that may be damaged.

    Times that cannot be end the reading; frames whose identifier cannot be are left out. What is behind a
    payload's length is zero; lengths 9 to 15 of classical frames mean eight bytes (ISO 11898-1, 10.4.2.4).
    """
    if len(unix_us) and not 0 <= unix_us.min() <= unix_us.max() < _LATEST_US:
        wrong = unix_us[(unix_us < 0) | (unix_us >= _LATEST_US)][0]
        raise LogError(f"{origin}: is damaged: a frame at {wrong / 1e6:g} s")
    can_id = frames.can_id
    length = np.minimum(frames.length, WIDTH)
    remote = can_id & RTR_FLAG != 0
    used = np.where(remote, 0, length)
    data = frames.data
    if len(used) and used.min() < WIDTH:
        data = np.where(np.arange(WIDTH) < used[:, None], data, 0).astype(np.uint8)
    piece = Piece(unix_us, buses(channel), FrameBatch(frames.t_ns, can_id, length, data), sent)
    beyond = (can_id & EFF_MASK > SFF_MASK) & (can_id & (EFF_FLAG | ERR_FLAG) == 0)
    if not beyond.any():
        return piece
    omitted[BEYOND] += int(beyond.sum())
    return piece.rows(~beyond)
