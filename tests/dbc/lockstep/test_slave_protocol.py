"""The flight node's side: what is heard, cut into epochs."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, batch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.slave_protocol import Slave, Task
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


def play(slave: Slave, *pieces: FrameBatch, now_s: float = 0.0) -> list:
    """Hears the pieces and does the work; what was done, as (task, block, fresh, sent)."""
    did = []
    for piece in pieces:
        for work in slave.hear(piece, now_s):
            sent = slave.answer(navigation(len(did))) if work.task is Task.STEP else work.block
            did.append((work.task, work.block, work.fresh, sent))
    return did


def tasks(did) -> list[Task]:
    return [task for task, *_ in did]


def test_an_epoch_is_everything_from_mark_to_sync():
    slave = Slave(CODEC)
    did = play(slave, heartbeat(), block(0), sync(0, 6))
    assert did == [(Task.STEP, block(0), True, concat((navigation(0), done(0, 3))))]
    did = play(slave, concat((block(1), sync(1, 6))))
    assert did == [(Task.STEP, block(1), False, concat((navigation(0), done(1, 3))))]
    assert slave.lost == 0


@given(st.lists(st.integers(0, 60), max_size=12))
def test_how_the_stream_is_chopped_makes_no_difference(cuts):
    stream = concat([piece for k in range(6) for piece in (block(k), sync(k, 6))] + [_end()])
    edges = [0, *sorted(c for c in cuts if c <= len(stream)), len(stream)]
    pieces = [stream[a:b] for a, b in pairwise(edges)]
    assert play(Slave(CODEC), *pieces) == play(Slave(CODEC), stream)


def _end(epoch: int = 6):
    return messages.encode(messages.END_ID, SESSION, epoch, 0)


def test_a_repeated_sync_gets_the_same_answer():
    slave = Slave(CODEC)
    first, again = play(slave, block(3), sync(3, 6), sync(3, 6))
    assert again == (Task.REPEAT, first[3], False, first[3])
    (after,) = play(slave, block(4), sync(4, 6))
    assert after[:3] == (Task.STEP, block(4), False)


def test_strays_between_answer_and_repeated_sync_wait_for_the_next_epoch():
    slave = Slave(CODEC)
    stray = batch([0x555], b"x")
    did = play(slave, block(3), sync(3, 6), stray, sync(3, 6), block(4), sync(4, 6))
    assert tasks(did) == [Task.STEP, Task.REPEAT, Task.STEP]
    assert did[2][1] == concat((stray, block(4)))


def test_syncs_of_past_epochs_are_ignored():
    slave = Slave(CODEC)
    assert tasks(play(slave, block(3), sync(3, 6), sync(2, 6))) == [Task.STEP]


def test_nothing_happens_before_the_first_mark():
    slave = Slave(CODEC)
    assert play(slave, measurements(4), sync(3, 9)) == []
    assert not slave.running
    (work,) = play(slave, block(4), sync(4, 6))
    assert work[1] == block(4)


def test_an_epoch_whose_mark_was_lost_is_still_answered():
    slave = Slave(CODEC)
    play(slave, block(0), sync(0, 6))
    (work,) = play(slave, measurements(5), sync(1, 6))
    assert work[:3] == (Task.STEP, measurements(5), False)
    assert slave.lost == 1
    (work,) = play(slave, sync(2, 6))  # nothing of it arrived
    assert work[1] == EMPTY
    assert slave.lost == 7


def test_a_repeated_or_replayed_mark_does_not_cut_an_epoch():
    slave = Slave(CODEC)
    play(slave, block(5), sync(5, 6))
    heard = concat((mark(6), measurements(2), mark(6), mark(3), measurements(1)))
    (work,) = play(slave, heard, sync(6, 6))
    assert work[1] == heard[[0, 1, 2, 5]]
    assert slave.refused_marks == 2


def test_a_corrupted_mark_names_no_new_run():
    slave = Slave(CODEC)
    play(slave, block(5), sync(5, 6))
    corrupted = mark(6, session=99)
    corrupted.data[0, 0] ^= 0x40
    (work,) = play(slave, corrupted, measurements(3), sync(6, 4))
    assert work[2] is False and len(work[1]) == 4


@pytest.mark.parametrize(
    ("session", "epoch"), [(SESSION + 1, 0), (SESSION, 0), (SESSION, 4), (SESSION + 1, 9)]
)
def test_a_new_run_starts_fresh(session, epoch):
    """A new session, or the same one going back: the emulator was started again."""
    slave = Slave(CODEC)
    play(slave, block(3), sync(3, 6), block(4), sync(4, 6))
    (work,) = play(slave, block(epoch, session=session), sync(epoch, 6, session))
    assert work[2] is True
    assert work[3][len(work[3]) - 1] == done(epoch, 3, session)


def test_the_end_is_told_once_and_the_node_waits_again():
    slave = Slave(CODEC)
    assert tasks(play(slave, block(0), sync(0, 6), _end(1), _end(1))) == [Task.STEP, Task.END]
    assert not slave.running
    (work,) = play(slave, block(0), sync(0, 6))
    assert work[2] is True


def test_without_sync_the_next_mark_ends_the_epoch_and_no_done_is_sent():
    slave = Slave(CODEC)
    did = play(slave, block(0), block(1), mark(2))
    assert [work[1] for work in did] == [block(0), block(1)]
    assert [work[2] for work in did] == [True, False]
    assert all(work[3] == navigation(k) for k, work in enumerate(did))


def test_without_sync_silence_ends_the_epoch_from_the_second_on():
    slave = Slave(CODEC, quiet_s=0.02, deadline_s=0.5)
    play(slave, block(0), statuses(), now_s=10.0)
    assert slave.due_s() is None
    play(slave, block(1), now_s=11.0)
    assert slave.due_s() == 11.5  # not all receivers have closed
    play(slave, statuses(), now_s=11.1)
    assert slave.due_s() == pytest.approx(11.12)
    assert list(slave.expire(11.11)) == []
    (work,) = slave.expire(11.12)
    assert work.block == concat((block(1), statuses()))
    assert slave.due_s() is None
    play(slave, block(2), now_s=12.0)
    (work,) = slave.expire(12.5)
    assert work.block == block(2)


def test_where_sync_is_sent_silence_ends_nothing():
    slave = Slave(CODEC)
    play(slave, block(0), sync(0, 6), block(1), statuses(), now_s=1.0)
    assert slave.due_s() is None
    assert list(slave.expire(1e9)) == []


def end_frame(session: int, epoch: int) -> FrameBatch:
    return messages.encode(messages.END_ID, session, epoch, 0)


STRAYS = {
    "END of another session": end_frame(SESSION + 1, 6),
    "END of another epoch": end_frame(SESSION, 600),
    "END without data": batch(messages.END_ID, b""),
    "UDS response": batch(0x7EF, bytes.fromhex("027E000000000000")),
    "UDS as END": batch(messages.END_ID, bytes.fromhex("027E000000000000")),
    "UDS as SYNC": batch(messages.SYNC_ID, bytes.fromhex("023E800000000000")),
    "SYNC of another session": sync(5, 9, session=SESSION + 1),
    "SYNC far ahead": sync(2**32 - 1, 0),
    "SYNC seven ahead": sync(12, 0),
    "SYNC behind": sync(3, 0),
    "MARK of another session": mark(5, session=SESSION + 1),
    "MARK leading on": mark(9),
    "MARK far ahead": mark(5 + 4096),
    "MARK farther ahead": mark(5 + 2**31),
    "MARK back": mark(1),
    "MARK again": mark(5),
}


@pytest.mark.parametrize("at", [0, 1, 3, 6], ids=["before", "after the mark", "amid", "behind"])
@pytest.mark.parametrize("stray", STRAYS.values(), ids=STRAYS)
def test_a_stray_costs_no_epoch(stray, at):
    """Every epoch is stepped once, by its SYNC, none is a fresh start; strays that say so are left out."""
    slave = Slave(CODEC)
    before = [piece for k in range(5) for piece in (block(k), sync(k, 6))]
    disturbed = concat((block(5)[:at], stray, block(5)[at:], sync(5, 6)))
    after = [piece for k in range(6, 9) for piece in (block(k), sync(k, 6))]
    did = play(slave, *before, disturbed, *after, end_frame(SESSION, 9))
    assert tasks(did) == [Task.STEP] * 9 + [Task.END]
    assert [work[2] for work in did] == [True] + [False] * 9
    answers = [messages.judge(sent, len(sent) - 1, SESSION, k) for k, (*_, sent) in enumerate(did[:-1])]
    assert [(a.epoch, a.session) for a in answers] == [(k, SESSION) for k in range(9)]
    kept = concat([frames for _, frames, _, _ in did[:-1]])
    bench, marks = len(messages.rows(stray)), int(stray.can_id[0] == 0x010)
    assert len(kept) == 9 * 6 + 1 - bench - marks
    assert (sum(slave.refused.values()), slave.refused_marks) == (bench, marks)


@pytest.mark.parametrize("at", [1, 3, 6])
def test_a_sync_of_the_last_epoch_is_out_of_turn_in_an_open_one(at):
    slave = Slave(CODEC)
    play(slave, block(4), sync(4, 6))
    (work,) = play(slave, block(5)[:at], sync(4, 6), block(5)[at:], sync(5, 6))
    assert work[1] == block(5)
    assert slave.refused == {messages.Refusal.OUT_OF_TURN: 1}


@pytest.mark.parametrize(
    "stray", [mark(5, session=99), mark(4096), mark(2**31)], ids=["session", "far", "farther"]
)
def test_without_sync_a_stray_mark_costs_no_epoch(stray):
    slave = Slave(CODEC)
    did = play(slave, *(block(k) for k in range(4)), stray, measurements(3), *(block(k) for k in range(4, 8)))
    assert [work[2] for work in did] == [True] + [False] * 6
    assert did[3][1] == concat((block(3), measurements(3)))
    assert [work[1] for work in did if work is not did[3]] == [block(k) for k in range(7) if k != 3]


@pytest.mark.parametrize(("session", "epoch"), [(SESSION + 1, 0), (SESSION, 0), (SESSION + 1, 900)])
def test_without_sync_another_run_begins_with_its_second_mark(session, epoch):
    slave = Slave(CODEC)
    play(slave, *(block(k) for k in range(4)))
    did = play(slave, *(block(epoch + k, session=session) for k in range(3)))
    assert [(work[1], work[2]) for work in did] == [
        (block(epoch, session=session), True),
        (block(epoch + 1, session=session), False),
    ]


def test_a_node_that_missed_many_epochs_goes_on_where_the_run_is():
    slave = Slave(CODEC)
    play(slave, block(0), sync(0, 6))
    (work,) = play(slave, block(500), sync(500, 6))
    assert work[:3] == (Task.STEP, block(500), False)


def test_a_run_that_began_with_a_stray_mark_begins_again_with_the_bench():
    slave = Slave(CODEC)
    did = play(slave, mark(5, session=99), block(0), sync(0, 6), block(1), sync(1, 6))
    assert [(work[1], work[2]) for work in did] == [(block(0), True), (block(1), False)]


def test_a_lost_sync_costs_no_epoch():
    """Its epoch is stepped when the next one is borne out, and sent without DONE."""
    slave = Slave(CODEC)
    did = play(slave, block(0), sync(0, 6), block(1), block(2), sync(2, 6))
    assert [work[1] for work in did] == [block(0), block(1), block(2)]
    assert did[1][3] == navigation(1)
    assert did[2][3] == concat((navigation(2), done(2, 3)))


def test_where_sync_closes_epochs_strays_do_not_bear_each_other_out():
    slave = Slave(CODEC)
    before = [piece for k in range(5) for piece in (block(k), sync(k, 6))]
    strays = [mark(k) for k in (6, 7, 22, 30)]
    did = play(slave, *before, block(5), *strays, sync(5, 6), block(6), sync(6, 6))
    assert [work[1] for work in did] == [block(k) for k in range(7)]
    assert slave.refused_marks == 4
