"""Time marks and the time that an epoch names: TIME_MARK, TIME_GPS and TIME_FINE in raw frames."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.arrays import I64, Index
from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.tools.decoder.block import EPOCHS, Block, of_frames, payloads
from gnss_hil.tools.decoder.screen import intact

MARK_KINDS = ("TIME_MARK", "TIME_GPS", "TIME_FINE")


@dataclass(frozen=True, slots=True)
class Marks:
    """Intact time marks of a batch: rows (n,), sessions (n,), epochs (n,)."""

    rows: Index
    session: I64
    epoch: I64


def marks_in(codec: Codec, frames: FrameBatch) -> Marks:
    """The intact time marks of frames (n,)."""
    rows = intact(codec, frames, "TIME_MARK")
    words, layout = payloads(frames[rows]), codec.kinds["TIME_MARK"]
    return Marks(rows, layout.signal("session", words), layout.signal("epoch", words))


def with_session(codec: Codec, frames: FrameBatch, session: int) -> FrameBatch:
    """The same frames, intact time marks with another session and their CRC made anew."""
    layout = codec.kinds["TIME_MARK"]
    at = layout.signals.index("session")
    rows = intact(codec, frames, "TIME_MARK")
    data = frames.data.copy()
    mask = layout.mask[at] << layout.shift[at]
    words = (payloads(frames[rows]) & ~mask) | np.uint64(session) << layout.shift[at]
    data[rows] = words.astype("<u8").view(np.uint8).reshape(-1, WIDTH)
    data[rows, 0] = e2e.crc(frames.can_id[rows], data[rows])
    return replace(frames, data=data)


def mark_times_ns(block: Block) -> I64:
    """(e,) GPS time of the marks [ns], -1 where their time frames are missing."""
    week, second = (block.grid("TIME_GPS", name, -1) for name in ("week", "second"))
    fine_ns = block.grid("TIME_FINE", "nanosecond", -1)
    t_ns = week * NS_PER_WEEK + second * NS_PER_S + fine_ns
    return np.where((week >= 0) & (fine_ns >= 0), t_ns, -1)


def epoch_times_ns(codec: Codec, frames: FrameBatch, counts: NDArray, numbers: NDArray) -> I64:
    """(e,) GPS time [ns] of epochs numbered (e,) that hold counts (e,) of the frames; -1 if not reported.

    Only intact frames of the epoch's own number count, the first of each kind.
    """
    rows = np.concatenate([intact(codec, frames, kind) for kind in ("TIME_GPS", "TIME_FINE")])
    epoch = np.searchsorted(np.cumsum(counts), rows, side="right")
    own = frames.data[rows, 1] >> 4 == numbers[epoch] % EPOCHS
    rows, epoch = rows[own], epoch[own]
    return mark_times_ns(of_frames(codec, frames[rows], epoch, len(counts)))


def reckoned_ns(reported: I64, numbers: I64, interval_ns: int, anchor: tuple[int, int]) -> I64:
    """(e,) GPS time [ns] of epochs: as reported, else reckoned by number from the last one that was.

    anchor  number and time [ns] of an epoch before all of these
    """
    known = reported >= 0
    last = np.maximum.accumulate(np.where(known, np.arange(len(reported)), -1))
    number = np.where(last >= 0, numbers[last], anchor[0])
    t_ns = np.where(last >= 0, reported[last], anchor[1])
    return t_ns + (numbers - number) * interval_ns
