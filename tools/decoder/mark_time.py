"""The time that an epoch says of itself: TIME_GPS and TIME_FINE as heard on the bus."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch

EPOCHS = 16
"""A frame names its epoch modulo this."""


def said_ns(codec: Codec, frames: FrameBatch, counts: NDArray, numbers: NDArray) -> NDArray[np.int64]:
    """(e,) GPS time [ns] of epochs numbered (e,) that hold counts (e,) of the frames; -1 if not said.

    Only intact frames of the epoch's own number count, the first of each kind.
    """
    epoch_of = np.repeat(np.arange(len(counts)), counts)

    def of(kind: str, value) -> NDArray[np.int64]:
        rows = np.flatnonzero((frames.can_id == codec.can_id_of[kind, 0]) & (frames.length == WIDTH))
        data = frames.data[rows]
        own = data[:, 1] >> 4 == numbers[epoch_of[rows]] % EPOCHS
        rows = rows[own & (data[:, 0] == e2e.crc(frames.can_id[rows], data))][::-1]  # the first one stands
        out = np.full(len(counts), -1, np.int64)
        out[epoch_of[rows]] = value(codec.decode(kind, frames.data[rows]))
        return out

    second = of("TIME_GPS", lambda said: said["week"] * NS_PER_WEEK + said["second"] * NS_PER_S)
    fine = of("TIME_FINE", lambda said: said["nanosecond"])
    return np.where((second >= 0) & (fine >= 0), second + fine, -1)


def marks_ns(
    said: NDArray[np.int64], numbers: NDArray[np.int64], interval_ns: int, anchor: tuple[int, int]
) -> NDArray[np.int64]:
    """(e,) GPS time [ns] of epochs: what they say, else reckoned by number from the last one that spoke.

    anchor  number and time [ns] of an epoch before all of these
    """
    known = said >= 0
    last = np.maximum.accumulate(np.where(known, np.arange(len(said)), -1))
    number = np.where(last >= 0, numbers[last], anchor[0])
    t_ns = np.where(last >= 0, said[last], anchor[1])
    return t_ns + (numbers - number) * interval_ns
