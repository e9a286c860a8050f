"""Blocks of the flight software: late, counted wrong, and closed twice."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract.frames import EMPTY, concat
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
)

pytestmark = pytest.mark.verifies(
    "tools/recording/flight_blocks.py",
    what="Blocks of the flight software on record",
    by="rules of ours: which frames a block claims, and what is told of it",
    status="modelled",
)


def test_an_answer_after_its_epoch_is_kept_where_it_was_heard():
    heard = [emulated(0), sync(0), emulated(1), sync(1), flown(0), done(0), flown(1), done(1)]
    assert recorded(*heard) == [(0, emulated(0)), (1, concat([emulated(1), flown(0), flown(1)]))]


def test_heartbeats_of_a_node_that_waits_between_epochs_leave_no_trace():
    """Seven seconds of silence, and a flight software announces itself twenty times."""
    assert recorded(*PLAIN[:4], *[GREETING] * 20, *PLAIN[4:]) == CANONICAL
    assert recorded(*PLAIN[:6], *[GREETING] * 20, *PLAIN[6:]) == CANONICAL


@pytest.mark.parametrize("behind", [1, 2, 7, 8, 15, 16, 40])
@pytest.mark.parametrize("lockstep", [True, False])
def test_a_late_answer_is_told_as_late_and_beyond_what_frames_can_tell_left_out(lockstep, behind):
    marks = [piece for k in range(1, behind + 1) for piece in (emulated(k), sync(k))]
    sequencer = Sequencer(CODEC, lockstep, SESSION)
    heard = sequencer.hear(concat([emulated(0), sync(0), *marks, flown(0), done(0)]))
    last = [*heard, *sequencer.finish()][-1]
    kept = flown(0) if behind < 8 else EMPTY
    assert (last.number, last.frames) == (behind, concat([emulated(behind), kept]))
    assert (sequencer.flight.late, sequencer.flight.lost) == (behind > 1, behind >= 8)


@pytest.mark.parametrize(
    ("said", "miscount"), [(1, (1, 1, 2)), (2, (0, 0, 0)), (3, (1, 3, 2)), (9, (1, 9, 2))]
)
@pytest.mark.parametrize("lockstep", [True, False])
def test_a_wrong_count_of_done_is_told(lockstep, said, miscount):
    answer = sealed(concat([frame("NAV_STATUS", 1), frame("NAV_X", 1)]), 1)
    sequencer = Sequencer(CODEC, lockstep, SESSION)
    heard = sequencer.hear(concat([*PLAIN[:6], answer, done(1, said)]))
    assert [*heard, *sequencer.finish()][1].frames == concat([emulated(1), answer])
    assert (sequencer.flight.miscounts, sequencer.flight.miscount) == (miscount[0], miscount)


def test_an_answer_given_twice_counts_right():
    """DONE was lost: the same frames come again."""
    answer = sealed(concat([frame("NAV_STATUS", 1), frame("NAV_X", 1)]), 1)
    sequencer = Sequencer(CODEC, True, SESSION)
    sequencer.hear(concat([*PLAIN[:6], answer, sync(1), answer, done(1)]))
    assert sequencer.flight.miscounts == 0
