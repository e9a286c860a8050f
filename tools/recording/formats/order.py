"""Time order: a log of two buses goes epoch by epoch, bus by bus; other formats want one time line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.recording.formats.piece import Piece

HOLD_US = 10_000_000
"""How far a frame may stand behind a later one."""

LATE = "out of order"


def in_time_order(pieces: Iterable[Piece], strayed: Counter[str]) -> Iterator[Piece]:
    """The same frames by time; those of one instant stay as they were.

    Frames that come more than HOLD_US too late stay late, and are counted.
    """
    held: list[Piece] = []
    written_us = np.iinfo(np.int64).min
    for piece in pieces:
        ordered = _sorted([*held, piece])
        stamps = ordered.unix_us
        if not len(stamps):
            continue
        if late := int((stamps < written_us).sum()):
            strayed[LATE] += late
        n = int(np.searchsorted(stamps, stamps[-1] - HOLD_US))
        held = [ordered.rows(slice(n, None))]
        if n:
            written_us = max(written_us, int(stamps[n - 1]))
            yield ordered.rows(slice(0, n))
    yield from held


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
    """The next piece that has a frame, in its time order."""
    return next((_sorted([piece]) for piece in stream if len(piece.unix_us)), None)
