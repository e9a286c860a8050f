"""The time of an epoch whose time frames are refused by their counters alone.

Counters of two masters of time do not follow each other, and the protection refuses both by turns. What the
flight software answers in such an epoch is on record, and it may have known better: the epoch has the time
that follows from those before by its number, if one of the masters says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import I64, U64
from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.tools.decoder.block import Block, Columns

NEAR_NS = 10**6
"""What a receiver's clock, where it shows the marks, may step by."""


@dataclass(frozen=True, slots=True)
class Reckoning:
    """Number and time [ns] of the last two epochs of which both are known; None before."""

    last: tuple[int, int] | None = None
    before: tuple[int, int] | None = None

    def after(self, number: int, t_ns: int) -> Reckoning:
        return Reckoning((number, t_ns), self.last)

    def expected_ns(self, number: int) -> float | None:
        """The time of an epoch; None if it does not follow from two."""
        if self.last is None or self.before is None or self.last[0] <= self.before[0]:
            return None
        (n, t_ns), (n_before, t_before_ns) = self.last, self.before
        return t_ns + (number - n) * (t_ns - t_before_ns) / (n - n_before)


def settled(block: Block, t_ns: I64, number: I64, refused: Columns, past: Reckoning) -> tuple[I64, Reckoning]:
    """Times (e,) of a block's epochs, -1 unknown, and what the next block's are reckoned by.

    number    (e,) of the epochs, -1 unknown
    refused   time frames that counters have refused, (n,): epoch, row of the block's; kind; word
    """
    doubtful = np.unique(refused["epoch"])
    doubtful = doubtful[(t_ns[doubtful] < 0) & (number[doubtful] >= 0)]
    if len(doubtful):
        t_ns = t_ns.copy()
        for row in doubtful.tolist():
            before = _reckoned(past, number[:row], t_ns[:row])
            t_ns[row] = _said(block, row, refused, before.expected_ns(int(number[row])))
    return t_ns, _reckoned(past, number, t_ns)


def _reckoned(past: Reckoning, number: I64, t_ns: I64) -> Reckoning:
    """After epochs (e,)."""
    for row in np.flatnonzero((number >= 0) & (t_ns >= 0))[-2:].tolist():
        past = past.after(int(number[row]), int(t_ns[row]))
    return past


def _said(block: Block, row: int, refused: Columns, expected_ns: float | None) -> int:
    """The time that a master says and that is expected; -1 if none does."""
    weeks, fines = (_words(block, kind, row, refused) for kind in ("TIME_GPS", "TIME_FINE"))
    if expected_ns is None:
        return -1
    gps, fine = block.codec.kinds["TIME_GPS"], block.codec.kinds["TIME_FINE"]
    second_ns = gps.signal("week", weeks) * NS_PER_WEEK + gps.signal("second", weeks) * NS_PER_S
    said = (second_ns[:, None] + fine.signal("nanosecond", fines)).ravel()
    off = np.abs(said - expected_ns)
    return int(said[off.argmin()]) if len(off) and off.min() <= NEAR_NS else -1


def _words(block: Block, kind: str, row: int, refused: Columns) -> U64:
    """Payloads of a kind in an epoch, accepted and refused."""
    accepted = block[kind]
    mine = (refused["epoch"] == row) & (refused["kind"] == block.codec.kinds[kind].number)
    return np.concatenate([accepted.words[accepted.epoch == row], refused["word"][mine]])
