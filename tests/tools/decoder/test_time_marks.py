"""Time marks in raw frames: which epoch, which session, which instant."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.gpstime import NS_PER_S, NS_PER_WEEK
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.tools.decoder.time_marks import epoch_times_ns, marks_in, reckoned_ns, with_session

CODEC = codec(4)
WEEK = 1712


def block(epoch: int, *, session: int = 3, second: int | None = None, fine: bool = True) -> FrameBatch:
    """Mark and time frames of an epoch."""
    kinds = {
        "TIME_MARK": {"session": session, "epoch": epoch},
        "TIME_GPS": {"week": WEEK, "second": 100 + epoch if second is None else second},
        "TIME_FINE": {"nanosecond": 250 + epoch},
    }
    if not fine:
        del kinds["TIME_FINE"]
    parts = [batch(CODEC.can_id_of[kind, 0], CODEC.encode(kind, said)) for kind, said in kinds.items()]
    return e2e.protect(CODEC, concat(parts), e2e.fresh_counters(CODEC), epoch)[0]


def instant_ns(epoch: int) -> int:
    return WEEK * NS_PER_WEEK + (100 + epoch) * NS_PER_S + 250 + epoch


def times(*blocks: FrameBatch, numbers) -> list[int]:
    counts = np.array([len(one) for one in blocks])
    return epoch_times_ns(CODEC, concat(blocks), counts, np.array(numbers)).tolist()


def test_marks_are_those_with_a_right_crc_and_length():
    frames = concat((block(4), block(5), block(6)))
    frames.data[3, 4] ^= 1
    frames.length[6] = 7
    marks = marks_in(CODEC, frames)
    assert (marks.rows.tolist(), marks.session.tolist(), marks.epoch.tolist()) == ([0], [3], [4])


def test_a_session_is_replaced_in_intact_marks_alone():
    frames = concat((block(4), block(5)))
    frames.data[3, 4] ^= 1
    other = with_session(CODEC, frames, 0xBEEF)
    assert marks_in(CODEC, other).session.tolist() == [0xBEEF]
    assert (other.data[1:] == frames.data[1:]).all()
    assert (with_session(CODEC, other, 3).data == frames.data).all()


def test_an_epoch_has_the_time_that_its_own_intact_frames_have():
    assert times(block(16), block(17), numbers=(16, 17)) == [instant_ns(16), instant_ns(17)]
    assert times(block(1), block(2, fine=False), block(3), numbers=(1, 2, 3))[1] == -1
    assert times(block(1), numbers=(2,)) == [-1], "frames of another epoch"
    damaged = block(1)
    damaged.data[1, 3] ^= 1
    assert times(damaged, numbers=(1,)) == [-1]


def test_of_several_times_in_one_epoch_the_first_stands():
    assert times(concat((block(1), block(1, second=999))), numbers=(1,)) == [instant_ns(1)]


def test_where_no_time_came_it_is_reckoned_by_number_from_the_last_that_did():
    numbers = np.array([5, 6, 8, 9])
    reported = np.array([-1, 600, -1, -1])
    assert reckoned_ns(reported, numbers, 10, (3, 570)).tolist() == [590, 600, 620, 630]
