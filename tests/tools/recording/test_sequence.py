"""The recorder's canonical order, whatever happened on the bus meanwhile."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.recording.sequence import Sequencer
from tests.support.run_pieces import (
    CANONICAL,
    CODEC,
    GREETING,
    PLAIN,
    SESSION,
    done,
    emulated,
    flown,
    frame,
    recorded,
    sealed,
    sync,
    time_mark,
)

pytestmark = pytest.mark.verifies(
    "tools/recording/recorder.py",
    "tools/recording/sequence.py",
    "tools/processes/bus_tap.py",
    "tools/processes/bus_session.py",
    "tools/decoder/time_marks.py",
    "tools/processes/inline.py",
    what="Record: canonical order and stamps of frames",
    by="an order of our own; the same bytes inline, embedded, on a real vcan, whichever side pauses",
    status="modelled",
)


@pytest.mark.parametrize("piece", [1, 2, 3, 1000])
def test_order_does_not_depend_on_the_pieces(piece):
    assert recorded(*PLAIN, piece=piece) == CANONICAL


@pytest.mark.parametrize(
    "heard",
    [
        [GREETING, GREETING, *PLAIN],
        [emulated(0), GREETING, sync(0), GREETING, flown(0), done(0), *PLAIN[4:]],
        [emulated(0), sync(0), sync(0), flown(0), done(0), flown(0), done(0), *PLAIN[4:]],
        [*PLAIN[:4], emulated(1), flown(0), done(0), sync(1), flown(1), done(1)],
        [*PLAIN[:4], flown(0), emulated(1), done(0), sync(1), flown(1), done(1)],
        [emulated(0), flown(0)[:1], sync(0), flown(0)[1:], done(0), *PLAIN[4:]],
    ],
    ids=["greetings", "late-greetings", "answered-twice", "second-answer-late", "across-mark", "early"],
)
def test_what_is_no_part_of_the_run_leaves_no_trace(heard):
    assert recorded(*heard) == CANONICAL


def test_frames_that_nobody_closes_are_kept():
    heard = [*PLAIN[:4], emulated(1), flown(1)]
    assert recorded(*heard) == CANONICAL


END = messages.encode(messages.END_ID, SESSION, 2, 0)


@pytest.mark.parametrize("lockstep", [True, False])
def test_after_the_end_nothing_belongs_to_the_run(lockstep):
    assert recorded(*PLAIN, END, GREETING, frame("RANGE", 1, 1), lockstep=lockstep) == CANONICAL
    other = messages.encode(messages.END_ID, SESSION + 1, 2, 0)
    late = frame("RANGE", 1, 1)
    assert recorded(*PLAIN, other, late)[1] == (1, concat([emulated(1), late, flown(1)]))


def test_without_a_sync_frames_stay_as_heard():
    heard = [GREETING, emulated(0), GREETING, emulated(1), flown(0), emulated(2), flown(2)]
    assert recorded(*heard) == [
        (0, emulated(0)),
        (1, concat([emulated(1), flown(0)])),
        (2, concat([emulated(2), flown(2)])),
    ]


def test_foreign_frames_are_kept():
    stranger = batch([0x7A0], b"whatever")
    (first, _) = recorded(emulated(0), stranger, *PLAIN[1:])
    assert first[1] == concat([emulated(0), stranger, flown(0)])


def test_at_other_paces_order_is_as_heard():
    heard = [GREETING, flown(0)[:1], emulated(0), flown(0), sync(0), emulated(1)]
    assert recorded(*heard, lockstep=False) == [(0, concat([emulated(0), flown(0)])), (1, emulated(1))]


def spoilt(mark: FrameBatch, bit: int = 61) -> FrameBatch:
    """The mark with one bit of its epoch turned over on the way."""
    data = mark.data.copy()
    data[0, bit // 8] ^= 1 << bit % 8
    return FrameBatch(mark.t_ns, mark.can_id, mark.length, data)


def cut(mark: FrameBatch) -> FrameBatch:
    return FrameBatch(mark.t_ns, mark.can_id, mark.length - 1, mark.data)


FALSE_MARKS = {
    "corrupted": spoilt(time_mark(1)),
    "wrong-length": cut(time_mark(1)),
    "repeated": time_mark(0),
    "absurdly-far": time_mark(4_000_000_000),
    "the-next-too-early": time_mark(1),
    "some-on": time_mark(9),
    "other-session": time_mark(1, SESSION + 1),
}


@pytest.mark.parametrize("lockstep", [True, False])
@pytest.mark.parametrize("false", FALSE_MARKS.values(), ids=FALSE_MARKS)
def test_a_mark_that_opens_no_epoch_is_a_frame_like_any_other(false, lockstep):
    """Damaged it is on record, for the digest to reject; intact it is left out, and counted."""
    heard = [emulated(0), false, sync(0), flown(0), done(0), *PLAIN[4:]]
    damaged = false in (FALSE_MARKS["corrupted"], FALSE_MARKS["wrong-length"])
    first = concat([emulated(0), *([false] if damaged else []), flown(0)])
    sequencer = Sequencer(CODEC, lockstep, SESSION)
    epochs = [*sequencer.hear(concat(heard)), *sequencer.finish()]
    assert [(e.number, e.frames) for e in epochs] == [(0, first), CANONICAL[1]]
    assert sequencer.refused_marks == (not damaged)


def test_a_replayed_mark_does_not_turn_time_back():
    heard = [*PLAIN, time_mark(0), emulated(2), sync(2)]
    assert recorded(*heard) == [*CANONICAL, (2, emulated(2))]


@pytest.mark.parametrize(
    "false", [spoilt(time_mark(0)), cut(time_mark(0))], ids=["corrupted", "wrong-length"]
)
def test_no_run_begins_with_a_spoilt_mark(false):
    assert recorded(false, GREETING, *PLAIN) == CANONICAL


def test_marks_that_were_lost_do_not_hold_up_the_next():
    assert recorded(emulated(0), emulated(16)) == [(0, emulated(0)), (16, emulated(16))]
    far = [emulated(0), emulated(900), emulated(901)]
    assert recorded(*far) == [(0, emulated(0)), (900, emulated(900)), (901, emulated(901))]
    far = [*PLAIN, emulated(900), sync(900), flown(2), done(900)]
    assert recorded(*far) == [*CANONICAL, (900, concat([emulated(900), flown(2)]))]


def declared_after(*heard: FrameBatch) -> int:
    sequencer = Sequencer(CODEC, lockstep=False)
    sequencer.hear(concat(heard))
    return sequencer.declared


def test_what_was_sent_is_unknown_unless_every_epoch_was_declared_by_both():
    assert declared_after() == 0
    assert declared_after(*PLAIN) == 8
    assert declared_after(*PLAIN[:3], *PLAIN[4:]) == 0, "an epoch without DONE"
    assert declared_after(*PLAIN[:7]) == 0, "the last epoch without DONE"
    assert declared_after(emulated(0), flown(0), done(0), *PLAIN[4:]) == 0, "an epoch without SYNC"
    assert declared_after(*[f for f in PLAIN if f.can_id[-1] != messages.DONE_ID]) == 0, "never a DONE"


@pytest.mark.parametrize("lockstep", [True, False])
def test_the_last_answer_may_come_after_the_end_and_nothing_else(lockstep):
    """At a free pace: it was flown, so it is on record."""
    late = [*PLAIN[:6], END, GREETING, frame("RANGE", 1, 1), *PLAIN[6:], time_mark(2), *PLAIN[6:]]
    assert declared_after(*late) == 8
    assert recorded(*late, lockstep=lockstep) == CANONICAL
    assert recorded(*PLAIN[:6], END, flown(1), lockstep=lockstep)[1] == (1, emulated(1)), "no DONE"


def test_declared_counts_each_block_once():
    sequencer = Sequencer(CODEC, lockstep=True)
    sequencer.hear(concat([emulated(0), sync(0), sync(0), flown(0), done(0), flown(0), done(0)]))
    assert sequencer.declared == 4
    assert [e.number for e in sequencer.finish()] == [0]


@pytest.mark.parametrize("lockstep", [True, False])
def test_bench_frames_of_something_else_are_refused_and_change_nothing(lockstep):
    other = [
        *(messages.encode(kind, SESSION + 1, 0, 2) for kind in (messages.SYNC_ID, messages.DONE_ID)),
        *(messages.encode(messages.END_ID, *label, 0) for label in ((SESSION + 1, 1), (SESSION, 9))),
        *(sync(9), sync(2**32 - 1), done(9), done(2**32 - 1)),
        batch(messages.SYNC_ID, bytes.fromhex("023E800000000000")),
        batch(messages.END_ID, b""),
    ]
    for at in range(1, len(PLAIN)):
        sequencer = Sequencer(CODEC, lockstep, SESSION)
        heard = sequencer.hear(concat([*PLAIN[:at], *other, *PLAIN[at:]]))
        assert [(e.number, e.frames) for e in [*heard, *sequencer.finish()]] == CANONICAL
        assert sum(sequencer.refused.values()) == len(other)
        assert (sequencer.declared, sequencer.unanswered, sequencer.ended) == (8, 0, False)


def test_the_record_is_of_the_known_session():
    of_another = messages.encode(messages.SYNC_ID, SESSION + 1, 5, 1)
    strays = [time_mark(5, SESSION + 1), of_another, time_mark(6, SESSION + 1)]
    sequencer = Sequencer(CODEC, True, SESSION)
    heard = sequencer.hear(concat([*strays, *PLAIN]))
    assert [(e.number, e.frames) for e in [*heard, *sequencer.finish()]] == CANONICAL
    assert sequencer.refused_marks == 2


@pytest.mark.parametrize("stray", [time_mark(5, SESSION + 1), time_mark(5)], ids=["session", "epoch"])
def test_a_record_that_began_with_a_stray_mark_begins_anew(stray):
    sequencer = Sequencer(CODEC, True)
    heard = sequencer.hear(concat([stray, *PLAIN]))
    assert [(e.number, e.frames) for e in [*heard, *sequencer.finish()]] == CANONICAL
    assert (sequencer.refused_marks, sequencer.opened) == (1, 2)


def test_another_run_behind_the_first_is_refused():
    again = [time_mark(k, SESSION + 1) for k in range(4)]
    sequencer = Sequencer(CODEC, True)
    heard = sequencer.hear(concat([*PLAIN, *again]))
    assert [(e.number, e.frames) for e in [*heard, *sequencer.finish()]] == CANONICAL
    assert sequencer.refused_marks == 4


@pytest.mark.parametrize("lockstep", [True, False])
def test_what_a_flight_software_says_before_the_first_mark_is_no_part_of_the_run(lockstep):
    assert recorded(frame("NAV_X", 1), *PLAIN, lockstep=lockstep) == CANONICAL


def test_noise_before_an_answer_is_no_frame_of_it():
    """It is of the answer's epoch, by a CRC that is wrong: the flight software did not say it."""
    answer, noise = sealed(frame("NAV_STATUS", 1), 1), frame("NAV_X", 1, header=1 << 4)
    for before, came in ((noise, 1), (sealed(noise, 1), 2)):
        sequencer = Sequencer(CODEC, True, SESSION)
        sequencer.hear(concat([*PLAIN[:6], before, answer, done(1, 1)]))
        assert sequencer.flight.miscount == ((0, 0, 0) if came == 1 else (1, 1, 2))


def test_what_was_declared_is_what_is_on_record_where_answers_are_too_late_for_it():
    blocks = [piece for k in range(9) for piece in (emulated(k), sync(k))]
    answers = [piece for k in range(9) for piece in (flown(k), done(k))]
    sequencer = Sequencer(CODEC, True, SESSION)
    heard = sequencer.hear(concat([*blocks, *answers]))
    assert sequencer.flight.lost == 1
    assert sequencer.declared == sum(len(one.frames) for one in [*heard, *sequencer.finish()])


@pytest.mark.parametrize("lockstep", [True, False])
def test_strays_do_not_bear_each_other_out(lockstep):
    strays = [time_mark(k) for k in (1, 2, 17, 25)]
    sequencer = Sequencer(CODEC, lockstep, SESSION)
    heard = sequencer.hear(concat([emulated(0), *strays, *PLAIN[1:]]))
    assert [(e.number, e.frames) for e in [*heard, *sequencer.finish()]] == CANONICAL
    assert sequencer.refused_marks == 4


def test_an_epoch_whose_mark_is_lost_is_an_epoch():
    """It begins behind the SYNC before, and its own SYNC says which it is."""
    without = emulated(1)[1:]
    heard = [
        emulated(0),
        sync(0),
        flown(0),
        done(0),
        without,
        sync(1),
        flown(1),
        done(1),
        emulated(2),
        sync(2),
    ]
    expected = [CANONICAL[0], (1, concat([without, flown(1)])), (2, emulated(2))]
    for piece in (1, 2, 1000):
        assert recorded(*heard, piece=piece) == expected


def test_frames_before_a_late_mark_are_of_its_epoch():
    late = concat([emulated(1)[1:], emulated(1)[:1]])
    heard = [emulated(0), sync(0), flown(0), done(0), late, sync(1), flown(1), done(1)]
    for piece in (1, 2, 1000):
        assert recorded(*heard, piece=piece) == [CANONICAL[0], (1, concat([late, flown(1)]))]
