"""What a receiver accepts: the states of a stream, and all that is no frame of the contract."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.e2e import COUNTERS, crc, fresh_counters, protect
from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, FrameBatch, batch, concat
from gnss_hil.dbc.contract.screening import Verdict, screen
from tests.support.streams import CODEC, RANGE, stream

pytestmark = pytest.mark.verifies(
    "dbc/contract/screening.py",
    what="Frames that a receiver refuses",
    by="statuses that AUTOSAR PRS Profile 11 gives for counters; frames that the contract has not",
    status="validated",
)


def verdicts(frames: FrameBatch, counters=None) -> list[Verdict]:
    screened = screen(CODEC, frames, fresh_counters(CODEC) if counters is None else counters)
    return [Verdict(v) for v in screened.verdict]


def test_an_undisturbed_stream_is_ok_over_batches():
    sender = receiver = fresh_counters(CODEC)
    for epoch in range(40):
        frames, sender = stream(7, 1, sender, epoch)
        screened = screen(CODEC, frames, receiver)
        receiver = screened.counters
        assert screened.verdict.tolist() == [Verdict.OK]
        assert screened.lost == 0


@pytest.mark.parametrize(
    ("kept", "expected", "lost"),
    [
        ([0, 1, 2], [Verdict.OK, Verdict.OK, Verdict.OK], 0),
        ([0, 0, 1], [Verdict.OK, Verdict.REPEATED, Verdict.OK], 0),
        ([0, 2, 3], [Verdict.OK, Verdict.LOST, Verdict.OK], 1),
        ([0, 3], [Verdict.OK, Verdict.LOST], 2),
        ([0, 4, 5], [Verdict.OK, Verdict.WRONG_SEQUENCE, Verdict.OK], 0),
        ([1, 0, 1], [Verdict.OK, Verdict.WRONG_SEQUENCE, Verdict.OK], 0),
    ],
)
def test_states_of_a_stream(kept, expected, lost):
    frames, _ = stream(2, 8)
    screened = screen(CODEC, frames[np.array(kept)], fresh_counters(CODEC))
    assert [Verdict(v) for v in screened.verdict] == expected
    assert screened.lost == lost
    assert len(screened.frames) == sum(v <= Verdict.LOST for v in expected)


@given(bit=st.integers(0, 63))
def test_any_flipped_bit_is_corruption(bit):
    frames, _ = stream(5, 1)
    data = frames.data.copy()
    data[0, bit // 8] ^= 1 << bit % 8
    assert verdicts(FrameBatch(frames.t_ns, frames.can_id, frames.length, data)) == [Verdict.CORRUPTED]


def test_masquerading_is_corruption():
    frames, _ = stream(0, 1)
    posed = FrameBatch(frames.t_ns, frames.can_id + 1, frames.length, frames.data)
    assert verdicts(posed) == [Verdict.CORRUPTED]


def test_a_corrupted_frame_does_not_disturb_its_stream():
    frames, _ = stream(1, 3)
    data = frames.data.copy()
    data[1, 5] ^= 0x40
    assert verdicts(FrameBatch(frames.t_ns, frames.can_id, frames.length, data)) == [
        Verdict.OK,
        Verdict.CORRUPTED,
        Verdict.LOST,
    ]


def test_after_a_corrupted_frame_the_stream_goes_on_in_the_next_block():
    frames, _ = stream(1, 4)
    data = frames.data.copy()
    data[1, 5] ^= 0x40
    first = screen(
        CODEC, FrameBatch(frames.t_ns, frames.can_id, frames.length, data)[:3], fresh_counters(CODEC)
    )
    assert verdicts(frames[3:], first.counters) == [Verdict.OK]
    assert verdicts(frames[2:3], first.counters) == [Verdict.REPEATED]


def test_a_counter_that_the_profile_has_not_is_corruption():
    frames, _ = stream(1, 1)
    data = frames.data.copy()
    data[0, 1] |= COUNTERS
    data[:, 0] = crc(frames.can_id, data)
    assert verdicts(FrameBatch(frames.t_ns, frames.can_id, frames.length, data)) == [Verdict.CORRUPTED]


@pytest.mark.parametrize(
    ("can_id", "length", "expected"),
    [
        (0x0FF, 8, Verdict.UNKNOWN_ID),
        (RANGE | 0x800, 8, Verdict.UNKNOWN_ID),
        (RANGE, 7, Verdict.WRONG_LENGTH),
        (RANGE | RTR_FLAG, 8, Verdict.REMOTE),
        (RANGE | EFF_FLAG, 8, Verdict.EXTENDED),
        (0x1234567 | EFF_FLAG, 8, Verdict.EXTENDED),
        (0x004 | ERR_FLAG, 8, Verdict.ERROR_FRAME),
        (RANGE, 64, Verdict.WRONG_LENGTH),
    ],
)
def test_foreign_frames_are_refused_among_good_ones(can_id, length, expected):
    good, _ = stream(0, 2)
    foreign = batch(can_id, bytes(8), length=length)
    assert verdicts(concat([good[0:1], foreign, good[1:2]])) == [Verdict.OK, expected, Verdict.OK]


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.integers(0, 255), st.binary(min_size=8, max_size=8))))
def test_never_raises_on_anything(rows):
    frames = concat([batch(i, d, length=n) for i, n, d in rows])
    assert len(screen(CODEC, frames, fresh_counters(CODEC)).verdict) == len(rows)


def test_bench_frames_are_protected_like_all():
    data = CODEC.encode("BENCH_SYNC", {"epoch": 5, "session": 3, "count": 7})
    frames = batch(CODEC.can_id_of["BENCH_SYNC", 0], data)
    assert verdicts(frames) == [Verdict.CORRUPTED]
    sealed, _ = protect(CODEC, frames, fresh_counters(CODEC), 5)
    assert verdicts(sealed) == [Verdict.OK]
