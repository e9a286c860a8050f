"""Marks of two masters in a block: which stands, what is refused, and that no counter is moved by it."""

from __future__ import annotations

from functools import partial
from itertools import product

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.flightsw.integrity.time_marks import follows
from gnss_hil.flightsw.io.frame_statistics import Reason
from gnss_hil.flightsw.io.rival_marks import MOST, rivals
from tests.support import synthetic_epochs as s
from tests.support.flights import SKY, SOYUZ, fly, soyuz
from tests.support.flown import CODEC, FakeBus, mark_frames

pytestmark = pytest.mark.verifies(
    "flightsw/io/rival_marks.py",
    what="A second time master: the mark that follows stands, others are told",
    by="rules of ours, flown on a fake bus beside the same flight without it; any counter, before and behind",
    status="validated",
)

S = 10**9
EPOCH = 11
PLACES = (0, 3, 40, -1)
MARK_IDS = [CODEC.can_id_of[kind, 0] for kind in ("TIME_MARK", "TIME_GPS", "TIME_FINE")]


@pytest.fixture(scope="module")
def flight():
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {})
    return config, *fly(bus, config, EPOCH + 5)


def master(epoch, by_s=0.0, ahead=0, counter=3, session=7, clock=0):
    """Its mark in an epoch."""
    t_ns = s.T0_NS + round((epoch + by_s) * S)
    frames = concat(mark_frames(epoch + ahead, t_ns, session, clock))
    sent = np.full(CODEC.streams, (counter - 1) % 15, np.int8)
    return e2e.protect(CODEC, frames, sent, epoch + ahead)[0]


def with_master(block, mark, place=3):
    return concat([block[:place], mark, block[place:]])


def found_in(flight, block, epoch=EPOCH):
    """Of a block of an epoch of the flight: (reason, identifier) of each frame that is refused."""
    state = flight[1][epoch - 1]
    found = rivals(CODEC, block, state.received.counters, partial(follows, state.marks))
    if found is None:
        return []
    return list(zip(found.reason.tolist(), block.can_id[found.rows].tolist(), strict=True))


def refused(reason):
    return [(reason, can_id) for can_id in MARK_IDS]


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        ({"by_s": 1.0}, Reason.JUMPED),
        ({"by_s": -1.0}, Reason.JUMPED),
        ({"by_s": 0.002}, Reason.JUMPED),
        ({"clock": 1, "by_s": 0.5}, Reason.JUMPED),
        ({"by_s": 3.0, "ahead": 3}, Verdict.MIXED_EPOCH),
        ({"by_s": 0.0, "ahead": 1}, Verdict.MIXED_EPOCH),
        ({"by_s": -2.0, "ahead": -2}, Verdict.MIXED_EPOCH),
        ({"by_s": 16.0, "ahead": 16}, Reason.JUMPED),
        ({"by_s": 1600.0, "ahead": 1600}, Reason.JUMPED),
    ],
)
def test_another_master_costs_no_fix_whatever_its_counter(flight, other, reason):
    """As without it, but for what is told; the counters of the mark are as without it too."""
    config, states, _, blocks = flight
    for counter in range(15):
        state = states[EPOCH - 1]
        for epoch in range(EPOCH, EPOCH + 3):
            mark = master(epoch, counter=counter + epoch, **other)
            state, answer = flight_step(config, state, with_master(blocks[epoch], mark, PLACES[counter % 4]))
            told = answer.can_id == CODEC.can_id_of["NAV_REFUSED", 0]
            said = CODEC.decode("NAV_REFUSED", answer[told].data)
            assert {reason} <= set(said["reason"].tolist()) <= {reason, Verdict.REPEATED}, (
                "bit for bit the same"
            )
            assert sorted(said["identifier"].tolist()) == MARK_IDS
            assert state.solution.fix is not None and state.mark == states[epoch].mark
            assert np.array_equal(state.solution.fix.position_m, states[epoch].solution.fix.position_m)
            assert np.array_equal(state.received.counters, states[epoch].received.counters)


def test_one_of_another_session_leaves_no_time_frames_behind(flight):
    config, states, _, blocks = flight
    state = states[EPOCH - 1]
    for epoch in range(EPOCH, EPOCH + 3):
        before = state.rejected
        state, _ = flight_step(config, state, with_master(blocks[epoch], master(epoch, 0.0, session=9)))
        told = {int(i): reason for reason, i in np.argwhere(state.rejected - before)}
        assert told == {
            MARK_IDS[0]: Reason.OTHER_SESSION, MARK_IDS[1]: Reason.JUMPED, MARK_IDS[2]: Reason.JUMPED
        }  # fmt: skip
        assert state.solution.fix is not None


def test_of_two_that_say_the_same_that_stands_whose_counter_does(flight):
    """Its frames are the true ones, wherever they are."""
    block = flight[3][EPOCH]
    for place, counter in product((0, 3), range(15)):
        if counter == EPOCH:  # the true one, bit for bit
            continue
        both = with_master(block, master(EPOCH, counter=counter), place)
        state = flight[1][EPOCH - 1]
        found = rivals(CODEC, both, state.received.counters, partial(follows, state.marks))
        assert found.rows.tolist() == [place, place + 1, place + 2]


def test_a_mark_that_comes_again_is_left_to_its_counter(flight):
    block = flight[3][EPOCH]
    assert found_in(flight, concat([block, block[:3]])) == []
    assert found_in(flight, with_master(concat([block, block[:3]]), master(EPOCH, 1.0))) == refused(
        Reason.JUMPED
    )


def test_one_mark_is_never_refused_here(flight):
    """Alone, true or false, it is judged as ever; so are several of which none follows."""
    block = flight[3][EPOCH]
    assert found_in(flight, block) == []
    assert found_in(flight, with_master(block[3:], master(EPOCH, 1.0), 0)) == []
    both = concat([master(EPOCH, 1.0), master(EPOCH, 50.0, counter=9)])
    assert found_in(flight, with_master(block[3:], both, 0)) == []
    assert found_in(flight, block, epoch=1) == [], "of the second epoch no interval is known"
    assert found_in(flight, with_master(flight[3][1], master(1, 1.0)), epoch=1) == []


def test_blocks_that_a_link_has_merged_keep_both_marks(flight):
    """The newer stands, as ever: the older is of another epoch, not another master's."""
    config, states, _, blocks = flight
    merged = concat([blocks[EPOCH], blocks[EPOCH + 1]])
    assert found_in(flight, merged) == []
    false = with_master(merged, master(EPOCH + 1, 5.0), len(blocks[EPOCH]) + 3)
    assert found_in(flight, false) == refused(Reason.JUMPED)
    state, _ = flight_step(config, states[EPOCH - 1], false)
    assert state.mark == states[EPOCH + 1].mark and state.solution.fix is not None


def test_a_mark_that_is_damaged_does_not_stand(flight):
    block = flight[3][EPOCH]
    data = block.data.copy()
    data[1, 4] ^= 1
    broken = type(block)(block.t_ns, block.can_id, block.length, data)
    assert found_in(flight, with_master(broken, master(EPOCH, 1.0))) == []


def test_parts_of_two_masters_make_no_mark(flight):
    """Half a second ahead at its number of the next epoch: week and second are the true ones."""
    block = flight[3][EPOCH]
    for part in range(3):
        false = master(EPOCH, 1.25, counter=9)
        left = np.delete(np.arange(3), part)
        assert found_in(flight, with_master(block, false[left])) == [
            (Reason.JUMPED, MARK_IDS[k]) for k in left
        ]


def test_of_very_many_none_is_put_together(flight):
    """A babbling master costs the fix, and hardly any time."""
    block = flight[3][EPOCH]
    few = concat([master(EPOCH, 1.0 + k, counter=9) for k in range(MOST - 1)])
    many = concat([few, master(EPOCH, 77.0, counter=9)])
    assert len(found_in(flight, with_master(block, few))) == 3 * (MOST - 1)
    assert found_in(flight, with_master(block, many)) == []
