"""The flight node's side: what is heard, cut into epochs."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, batch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.slave import Follower, Task
from tests.support.lockstep_frames import (
    CODEC,
    SESSION,
    block,
    done,
    heartbeat,
    mark,
    measurements,
    navigation,
    statuses,
    sync,
)

pytestmark = pytest.mark.verifies(what="Lockstep: barrier, epochs, repetitions, both sides")


def play(follower: Follower, *pieces: FrameBatch, now_s: float = 0.0) -> list:
    """Hears the pieces and does the work; what was done, as (task, block, fresh, sent)."""
    did = []
    for piece in pieces:
        for work in follower.hear(piece, now_s):
            sent = follower.answer(navigation(len(did))) if work.task is Task.STEP else work.block
            did.append((work.task, work.block, work.fresh, sent))
    return did


def tasks(did) -> list[Task]:
    return [task for task, *_ in did]


def test_an_epoch_is_everything_from_mark_to_sync():
    follower = Follower(CODEC)
    did = play(follower, heartbeat(), block(0), sync(0, 6))
    assert did == [(Task.STEP, block(0), True, concat((navigation(0), done(0, 3))))]
    did = play(follower, concat((block(1), sync(1, 6))))
    assert did == [(Task.STEP, block(1), False, concat((navigation(0), done(1, 3))))]
    assert follower.lost == 0


@given(st.lists(st.integers(0, 60), max_size=12))
def test_how_the_stream_is_chopped_makes_no_difference(cuts):
    stream = concat([piece for k in range(6) for piece in (block(k), sync(k, 6))] + [_end()])
    edges = [0, *sorted(c for c in cuts if c <= len(stream)), len(stream)]
    pieces = [stream[a:b] for a, b in pairwise(edges)]
    assert play(Follower(CODEC), *pieces) == play(Follower(CODEC), stream)


def _end():
    return messages.encode(messages.END_ID, SESSION, 6, 0)


def test_a_repeated_sync_gets_the_same_answer():
    follower = Follower(CODEC)
    first, again = play(follower, block(3), sync(3, 6), sync(3, 6))
    assert again == (Task.REPEAT, first[3], False, first[3])
    (after,) = play(follower, block(4), sync(4, 6))
    assert after[:3] == (Task.STEP, block(4), False)


def test_strays_between_answer_and_repeated_sync_wait_for_the_next_epoch():
    follower = Follower(CODEC)
    stray = batch([0x555], b"x")
    did = play(follower, block(3), sync(3, 6), stray, sync(3, 6), block(4), sync(4, 6))
    assert tasks(did) == [Task.STEP, Task.REPEAT, Task.STEP]
    assert did[2][1] == concat((stray, block(4)))


def test_syncs_of_past_epochs_are_ignored():
    follower = Follower(CODEC)
    assert tasks(play(follower, block(3), sync(3, 6), sync(2, 6))) == [Task.STEP]


def test_nothing_happens_before_the_first_mark():
    follower = Follower(CODEC)
    assert play(follower, measurements(4), sync(3, 9)) == []
    assert not follower.running
    (work,) = play(follower, block(4), sync(4, 6))
    assert work[1] == block(4)


def test_an_epoch_whose_mark_was_lost_is_still_answered():
    follower = Follower(CODEC)
    play(follower, block(0), sync(0, 6))
    (work,) = play(follower, measurements(5), sync(1, 6))
    assert work[:3] == (Task.STEP, measurements(5), False)
    assert follower.lost == 1
    (work,) = play(follower, sync(2, 6))  # nothing of it arrived
    assert work[1] == EMPTY
    assert follower.lost == 7


def test_a_repeated_or_replayed_mark_does_not_cut_an_epoch():
    follower = Follower(CODEC)
    play(follower, block(5), sync(5, 6))
    heard = concat((mark(6), measurements(2), mark(6), mark(3), measurements(1)))
    (work,) = play(follower, heard, sync(6, 6))
    assert work[1] == heard


def test_a_corrupted_mark_names_no_new_run():
    follower = Follower(CODEC)
    play(follower, block(5), sync(5, 6))
    corrupted = mark(6, session=99)
    corrupted.data[0, 0] ^= 0x40
    (work,) = play(follower, corrupted, measurements(3), sync(6, 4))
    assert work[2] is False and len(work[1]) == 4


@pytest.mark.parametrize(
    ("session", "epoch"), [(SESSION + 1, 0), (SESSION, 0), (SESSION, 4), (SESSION + 1, 9)]
)
def test_a_new_run_starts_fresh(session, epoch):
    """A new session, or the same one going back: the emulator was started again."""
    follower = Follower(CODEC)
    play(follower, block(3), sync(3, 6), block(4), sync(4, 6))
    (work,) = play(follower, block(epoch, session=session), sync(epoch, 6, session))
    assert work[2] is True
    assert work[3][len(work[3]) - 1] == done(epoch, 3, session)


def test_the_end_is_told_once_and_the_node_waits_again():
    follower = Follower(CODEC)
    assert tasks(play(follower, block(0), sync(0, 6), _end(), _end())) == [Task.STEP, Task.END]
    assert not follower.running
    (work,) = play(follower, block(0), sync(0, 6))
    assert work[2] is True


def test_without_sync_the_next_mark_ends_the_epoch_and_no_done_is_sent():
    follower = Follower(CODEC)
    did = play(follower, block(0), block(1), mark(2))
    assert [work[1] for work in did] == [block(0), block(1)]
    assert [work[2] for work in did] == [True, False]
    assert all(work[3] == navigation(k) for k, work in enumerate(did))


def test_without_sync_silence_ends_the_epoch_from_the_second_on():
    follower = Follower(CODEC, quiet_s=0.02, deadline_s=0.5)
    play(follower, block(0), statuses(), now_s=10.0)
    assert follower.due_s() is None
    play(follower, block(1), now_s=11.0)
    assert follower.due_s() == 11.5  # not all receivers have closed
    play(follower, statuses(), now_s=11.1)
    assert follower.due_s() == pytest.approx(11.12)
    assert list(follower.expire(11.11)) == []
    (work,) = follower.expire(11.12)
    assert work.block == concat((block(1), statuses()))
    assert follower.due_s() is None
    play(follower, block(2), now_s=12.0)
    (work,) = follower.expire(12.5)
    assert work.block == block(2)


def test_where_sync_is_sent_silence_ends_nothing():
    follower = Follower(CODEC)
    play(follower, block(0), sync(0, 6), block(1), statuses(), now_s=1.0)
    assert follower.due_s() is None
    assert list(follower.expire(1e9)) == []
