"""Does all come that a receiver says it has sent? Its STATUS counts its measurement frames and its TAG.

A channel that is there in part is INCOMPLETE by itself; of one that is lost whole nothing tells but the
STATUS. What came counts, used or not: what was refused has its own reason. A frame that cannot be read may be
of any channel and stands for itself. Whole channels are missed, no less: a STATUS may count a frame or two
that are no measurements.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.limits import CHANNELS
from gnss_hil.dbc.contract import screening
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import MEASUREMENT_KINDS
from gnss_hil.dbc.contract.screening import Verdict

FRAMES, TAG = len(MEASUREMENT_KINDS), 1
"""Of a channel in an epoch, and of a receiver beside."""


def accounted(channels: I64) -> I64:
    """What a STATUS counts of so many channels: their frames, and the TAG."""
    return FRAMES * channels + TAG


def missed(codec: Codec, frames: FrameBatch, receiver: I64, announced: F64) -> Bool:
    """(n,) of receivers, 0-based, whose STATUS counts so many frames: whether they sent channels of which
    none of a block's frames is."""
    sender = _sender(codec)[frames.can_id & SFF_MASK]
    measured = frames[sender >= 0]
    sender = sender[sender >= 0]
    intact = screening.checked(codec, measured).verdict == Verdict.OK
    heard = np.zeros((codec.receivers, CHANNELS), bool)
    sound = measured[intact]
    heard[sender[intact], codec.key_of(sound.can_id, sound.data) - codec.first_stream_of[sound.can_id]] = True
    unreadable = np.bincount(sender[~intact], minlength=codec.receivers)
    channels = (announced - TAG - unreadable[receiver]) // FRAMES
    return channels > heard.sum(axis=1)[receiver]


@cache
def _sender(codec: Codec) -> I64:
    """(2048,) receiver, 0-based, whose measurements have an identifier; -1 none."""
    found = np.full(IDENTIFIERS, -1)
    for (kind, number), can_id in codec.can_id_of.items():
        if kind in MEASUREMENT_KINDS:
            found[can_id] = number - 1
    return found
