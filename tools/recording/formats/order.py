"""Time order: a log of two buses goes epoch by epoch, bus by bus; other formats want one time line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.recording.formats.candump import Piece

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
        stamps = ordered[0]
        if not len(stamps):
            continue
        if late := int((stamps < written_us).sum()):
            strayed[LATE] += late
        n = int(np.searchsorted(stamps, stamps[-1] - HOLD_US))
        held = [_rows(ordered, slice(n, None))]
        if n:
            written_us = max(written_us, int(stamps[n - 1]))
            yield _rows(ordered, slice(0, n))
    yield from held


def _sorted(pieces: list[Piece]) -> Piece:
    unix_us = np.concatenate([piece[0] for piece in pieces])
    bus = np.concatenate([piece[1] for piece in pieces])
    frames = concat([piece[2] for piece in pieces])
    if (np.diff(unix_us) >= 0).all():
        return unix_us, bus, frames
    rows = np.argsort(unix_us, kind="stable")
    return unix_us[rows], bus[rows], frames[rows]


def _rows(piece: Piece, rows: slice) -> Piece:
    return piece[0][rows], piece[1][rows], piece[2][rows]
