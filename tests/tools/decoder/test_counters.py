"""One record of what was heard, lost and rejected."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import batch, concat
from gnss_hil.tools.decoder.counters import Counters, total
from gnss_hil.tools.decoder.screen import Screen, intact

CODEC = codec(4)
RANGE = CODEC.can_id_of["RANGE", 1]


def stream(count: int, channel: int = 2):
    """Frames of one protected stream, counters 0, 1, ..."""
    data = np.repeat(CODEC.encode("RANGE", {"channel": channel}), count, axis=0)
    return e2e.protect(CODEC, batch(np.full(count, RANGE), data), e2e.fresh_counters(CODEC), 0)[0]


def test_a_screen_counts_every_frame_once_whatever_the_pieces():
    frames = stream(9)
    heard = concat((frames[:3], frames[4:6], frames[5:6], batch([0x7AB], b"12345678"), frames[6:]))
    once, often = Screen(CODEC), Screen(CODEC)
    once.take(heard)
    for i in range(len(heard)):
        often.take(heard[i])
    assert once.counters == often.counters
    assert once.counters.received == len(heard) == 10
    assert once.counters.lost == 1
    assert once.counters.reasons == {"REPEATED": 1, "UNKNOWN_ID": 1}


def test_after_forgetting_a_stream_begins_anew():
    screen, frames = Screen(CODEC), stream(3)
    screen.take(frames)
    screen.forget()
    screen.take(frames)
    assert screen.counters == Counters(received=6)


def test_intact_frames_are_of_the_kind_and_their_crc_is_right():
    frames = concat((stream(3), batch([RANGE], b"123", length=3)))
    frames.data[1, 6] ^= 1
    assert intact(CODEC, frames, "RANGE", 1).tolist() == [0, 2]
    assert not len(intact(CODEC, frames, "RANGE", 2))


def test_figures_of_several_buses():
    """Sent is what the senders declare, or what was received and the counters of the streams miss."""
    one, other = Counters(90, 2), Counters(50, 1)
    one.reject("CORRUPTED", 3)
    other.reject("CORRUPTED", 1)
    other.reject("EXTENDED", 0)
    both = total((one, other))
    assert both.figures(None) == {"sent": 143, "received": 140, "lost": 3, "rejected": {"CORRUPTED": 4}}
    assert both.figures(150) == {"sent": 150, "received": 140, "lost": 10, "rejected": {"CORRUPTED": 4}}
    assert both.figures(100)["sent"] == 143, "one of the senders declares nothing"
