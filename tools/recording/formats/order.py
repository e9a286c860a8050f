"""Time order: a log of two buses goes epoch by epoch, bus by bus; other formats want one time line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.recording.formats.piece import Piece

HOLD_US = 10_000_000
"""How far a frame may stand behind a later one."""
_SECOND_US = 1_000_000
_LEAPS_US = np.array(gpstime.LEAPS_UNIX_S) * _SECOND_US
"""UNIX times that come twice: the leap second has the stamps of the second behind it."""
_STEP_US = 100
"""A bus whose stamps go back by more than this in such a second is in it for the second time."""

LATE = "out of order"


def in_time_order(pieces: Iterable[Piece], strayed: Counter[str]) -> Iterator[Piece]:
    """The same frames by time; those of one instant stay as they were.

    Frames that come more than HOLD_US too late stay late, and are counted. The order is that of time, which
    goes on through a leap second, where the stamps do not.
    """
    held: list[Piece] = []
    waiting = np.zeros(0, np.int64)
    written_us = np.iinfo(np.int64).min
    clock = _Clock()
    for piece in pieces:
        if not len(piece.unix_us):
            continue
        ordered, at_us = joined([*held, piece]), np.r_[waiting, clock.uniform_us(piece)]
        if (np.diff(at_us) < 0).any():
            rows = np.argsort(at_us, kind="stable")
            ordered, at_us = ordered.rows(rows), at_us[rows]
        if late := int((at_us < written_us).sum()):
            strayed[LATE] += late
        n = int(np.searchsorted(at_us, at_us[-1] - HOLD_US))
        held, waiting = [ordered.rows(slice(n, None))], at_us[n:]
        if n:
            written_us = max(written_us, int(at_us[n - 1]))
            yield ordered.rows(slice(0, n))
    yield from held


class _Clock:
    """Which of the two seconds that have the same stamps each bus is in."""

    def __init__(self):
        self._before_us: dict[bytes, int] = {}
        self._again: dict[bytes, int] = {}

    def uniform_us(self, piece: Piece) -> NDArray[np.int64]:
        """(n,) UNIX times [us], and a second for every leap second since."""
        unix_us = piece.unix_us
        over = np.searchsorted(_LEAPS_US, unix_us - _SECOND_US, "right")  # leap seconds that are surely over
        twice = over != np.searchsorted(_LEAPS_US, unix_us, "right")
        for name in np.unique(piece.bus[twice]).tolist() if twice.any() else ():
            rows = np.flatnonzero(twice & (piece.bus == name))
            before_us = np.r_[self._before_us.get(name, 0), unix_us[rows[:-1]]]
            back = unix_us[rows] < before_us - _STEP_US
            back[0] |= self._again.get(name) == over[rows[0]]
            over[rows] += np.logical_or.accumulate(back)
            self._before_us[name] = int(unix_us[rows[-1]])
            if back.any():
                self._again[name] = int(np.searchsorted(_LEAPS_US, unix_us[rows[-1]], "right")) - 1
        return unix_us + over * _SECOND_US


def joined(pieces: Sequence[Piece]) -> Piece:
    """Pieces, at least one, as one."""
    unix_us, bus, frames, sent = zip(*pieces, strict=True)
    return Piece(np.concatenate(unix_us), np.concatenate(bus), concat(frames), np.concatenate(sent))


def _sorted(pieces: Sequence[Piece]) -> Piece:
    piece = joined(pieces)
    if (np.diff(piece.unix_us) >= 0).all():
        return piece
    return piece.rows(np.argsort(piece.unix_us, kind="stable"))


def merged(streams: Iterable[Iterator[Piece]]) -> Iterator[Piece]:
    """Several streams as one by time, each of them in its own order; of an instant the first stream's first.

    A piece of each is held.
    """
    held = [(stream, piece) for stream in streams if (piece := _some(stream)) is not None]
    while held:
        if len(held) == 1:  # as it is: a leap second may be in it
            ((stream, piece),) = held
            yield piece
            yield from stream
            return
        held = [(stream, _sorted([piece])) for stream, piece in held]
        until_us = min(piece.unix_us[-1] for _, piece in held)
        parts, after = [], []
        for stream, piece in held:
            n = int(np.searchsorted(piece.unix_us, until_us, "right"))
            parts.append(piece.rows(slice(0, n)))
            rest = piece.rows(slice(n, None)) if n < len(piece.unix_us) else _some(stream)
            if rest is not None:
                after.append((stream, rest))
        yield parts[0] if len(parts) == 1 else _sorted(parts)
        held = after


def _some(stream: Iterator[Piece]) -> Piece | None:
    """The next piece that has a frame."""
    return next((piece for piece in stream if len(piece.unix_us)), None)
