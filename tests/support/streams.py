"""Frames of one protected stream, as a sender seals them."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.e2e import fresh_counters, protect
from gnss_hil.dbc.contract.frames import FrameBatch, batch

CODEC = codec(4)
RANGE = CODEC.can_id_of["RANGE", 1]


def stream(channel: int, count: int, counters=None, epoch=0) -> tuple[FrameBatch, np.ndarray]:
    """So many ranges of a channel, and the sender's next counters."""
    data = CODEC.encode("RANGE", {"channel": np.full(count, channel), "pseudorange_m": 2.1e7})
    return protect(
        CODEC,
        batch(np.full(count, RANGE), data),
        fresh_counters(CODEC) if counters is None else counters,
        epoch,
    )
