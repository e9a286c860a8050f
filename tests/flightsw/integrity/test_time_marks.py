"""Time marks one after another: which are believed."""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest

from gnss_hil.flightsw.integrity.time_marks import (
    DOUBTED_S,
    LASTING,
    SHOWN_NS,
    STEADY_NS,
    TOLERANCE_NS,
    TimeMarks,
    advanced,
    follows,
)
from gnss_hil.flightsw.records.epoch import Mark

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/time_marks.py",
    what="Time marks that follow from those before",
    by="rules of ours, mark by mark: jumps of a millisecond to 1,024 weeks, gaps, a first one that is wrong",
    status="modelled",
)

S = 10**9
WEEK_S = 604_800
T0_NS = 10**18


def marks(*ns, epochs=None, clock=0):
    """At ns after the first, of these epochs."""
    numbers = range(len(ns)) if epochs is None else epochs
    return [Mark(7, epoch, T0_NS + t_ns, 18, clock) for epoch, t_ns in zip(numbers, ns, strict=True)]


def believed(sequence, agree=False, state=None):
    """After the last, and of each whether it is."""
    state, found = state or TimeMarks(), []
    for mark in sequence:
        state, yes = advanced(state, mark, agree)
        found.append(yes)
    return state, found


def flown(interval_ns=S, count=4):
    return believed(marks(*(k * interval_ns for k in range(count))))[0]


@pytest.mark.parametrize("interval_ns", [10**8, S, 30 * S])
def test_marks_as_far_apart_as_ever_are_believed(interval_ns):
    state, found = believed(marks(*(k * interval_ns for k in range(20))))
    assert all(found) and state.interval_ns == interval_ns and state.refused == 0


def test_marks_that_a_receivers_clock_shows_are():
    """It drifts by 20 us a second, and is set back by a millisecond every fifty."""
    shown = [k * S + 20_000 * (k % 50) for k in range(500)]
    assert all(believed(marks(*shown, clock=1))[1])


@pytest.mark.parametrize("step_ns", [20_000, -20_000, 300_000, 999_000])
def test_a_small_step_of_marks_that_were_steady_is_believed_when_it_lasts(step_ns):
    """Half a millisecond moves a fix of decimetres by four metres."""
    steady = flown(count=20)
    once = marks(20 * S + step_ns, 21 * S, epochs=[20, 21])
    assert believed(once, state=steady)[1] == [False, True]
    lasting = marks(*(k * S + step_ns for k in range(20, 40)), epochs=range(20, 40))
    assert believed(lasting, state=steady)[1] == [False] * LASTING + [True] * (20 - LASTING)
    assert all(believed(marks(20 * S + 9_000, 21 * S, epochs=[20, 21]), state=steady)[1])


def doubted(sequence, state):
    """Of each mark whether it is believed, and what is doubted of it."""
    for mark in sequence:
        state, yes = advanced(state, mark, False)
        yield yes, state.doubt_s * S


@pytest.mark.parametrize("drift_ns", [2_000, 9_900, -9_900, 11_000, 120_000, 249_000])
def test_marks_that_drift_off_are_told_and_in_doubt_by_as_much(drift_ns):
    """Each is beside the last by what a step may be; five minutes later they are 75 m off."""
    steady = flown(count=110)
    off_ns = [drift_ns * (k + 1) for k in range(290)]
    drifting = marks(*((110 + k) * S + off for k, off in enumerate(off_ns)), epochs=range(110, 400))
    found = [*doubted(drifting, steady)]
    told = sum(not yes for yes, _ in found)
    assert told >= LASTING
    for off, (yes, doubt_ns) in zip(off_ns, found, strict=True):
        assert not yes or abs(abs(off) - doubt_ns) <= 2 * STEADY_NS
        assert not yes or abs(off) <= TOLERANCE_NS + 2 * STEADY_NS


def test_a_step_is_in_doubt_until_it_has_lasted_for_minutes():
    lasting = marks(*(k * S + 300_000 for k in range(20, 420)), epochs=range(20, 420))
    found = [*doubted(lasting, flown(count=20))]
    assert [yes for yes, _ in found] == [False] * LASTING + [True] * 397
    assert {round(doubt) for _, doubt in found[LASTING : int(DOUBTED_S)]} == {300_000}
    assert {doubt for _, doubt in found[int(DOUBTED_S) :]} == {0.0}


def test_a_mark_on_the_line_again_is_in_no_doubt():
    state = believed(
        marks(*(k * S + 300_000 for k in range(20, 40)), epochs=range(20, 40)), state=flown(count=20)
    )[0]
    assert state.doubt_s == pytest.approx(3e-4)
    (found,) = doubted(marks(40 * S, epochs=[40]), state)
    assert found == (True, pytest.approx(0.0, abs=1.0))


def test_a_receivers_clock_that_shows_the_marks_from_now_on_is_in_no_doubt():
    """What it is off by is part of the fix."""
    other = marks(*(k * S + 300_000 + 20_000 * k for k in range(20, 60)), epochs=range(20, 60), clock=1)
    found = [*doubted(other, flown(count=20))]
    assert found[LASTING:] == [(True, 0.0)] * 37


def test_a_line_follows_a_rate_that_changes_slowly():
    """By 3e-11 in five hours, as an oscillator's does with its temperature; 150 us off the first rate."""
    late = [round(1e-3 * k * k / 2) for k in range(18_000)]
    assert {*doubted(marks(*(k * S + off for k, off in enumerate(late))), TimeMarks())} == {(True, 0.0)}


@pytest.mark.parametrize("interval_ns", [S + 2_000, 999_990_000, 333_333_333])
def test_marks_are_on_a_line_of_their_own_rate(interval_ns):
    """An interval that is not the round one is no drift."""
    assert {*doubted(marks(*(k * interval_ns for k in range(2000))), TimeMarks())} == {(True, 0.0)}


def test_a_line_is_followed_through_noise():
    """A microsecond of it, an hour long: none is refused, and none in doubt."""
    noise = np.random.default_rng(1).normal(0, 1000, 3600).round().astype(int).tolist()
    sequence = marks(*(k * S + late for k, late in enumerate(noise)))
    assert {*doubted(sequence, TimeMarks())} == {(True, 0.0)}


@pytest.mark.parametrize("change", [{"clock": 1}, {"leap": 80}, {"leap": 16}])
def test_another_clock_or_other_leap_seconds_are_believed_when_they_last(change):
    """A clock that is off by 0.3 ms moves the fix by two metres."""
    other = [replace(mark, **change) for mark in marks(*(k * S for k in range(4, 12)), epochs=range(4, 12))]
    assert believed(other, state=flown())[1] == [False] * LASTING + [True] * (8 - LASTING)
    right = marks(5 * S, epochs=[5])
    assert believed([other[0], *right], state=flown())[1] == [False, True]


def test_a_leap_second_is_believed():
    later = [replace(mark, leap=19) for mark in marks(4 * S, 5 * S, epochs=[4, 5])]
    assert believed(later, state=flown())[1] == [True, True]


@pytest.mark.parametrize(
    ("ns", "change", "expected"),
    [
        (20 * S, {}, True),
        (20 * S + 9_000, {}, True),
        (20 * S + 20_000, {}, False),
        (21 * S, {}, False),
        (20 * S, {"leap": 19}, True),
        (20 * S, {"leap": 20}, False),
        (20 * S, {"clock": 1}, False),
        (20 * S, {"session": 8}, False),
        (35 * S, {"epoch": 35}, True),
        (19 * S, {"epoch": 19}, False),
        (5 * S, {"epoch": 5}, False),
    ],
)
def test_one_is_expected_only_if_nothing_about_it_is_new(ns, change, expected):
    (mark,) = marks(ns, epochs=[20])
    assert follows(flown(count=20), replace(mark, **change)) is expected


def test_nothing_is_expected_before_the_interval_is_known():
    assert not follows(TimeMarks(), *marks(0))
    assert not follows(believed(marks(0, S))[0], *marks(2 * S, epochs=[2]))
    assert follows(believed(marks(0, S, 2 * S))[0], *marks(3 * S, epochs=[3]))


def test_marks_that_jitter_are_believed():
    jitter = [k * S + (k * 7919 % 101) * 9_000 for k in range(200)]
    assert all(believed(marks(*jitter))[1])


def test_after_missing_epochs_time_has_advanced_by_as_many():
    assert believed(marks(20 * S, 21 * S, epochs=[20, 21]), state=flown())[1] == [True, True]
    assert believed(marks(5 * S, epochs=[20]), state=flown())[1] == [False]


@pytest.mark.parametrize("agree", [True, False])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("jump_s", [0.0011, 0.01, 0.1, 0.249])
def test_a_step_too_short_for_satellites_to_show_is_not_believed(jump_s, sign, agree):
    jump_ns = round(sign * jump_s * S)
    assert TOLERANCE_NS < abs(jump_ns) < SHOWN_NS
    state, found = believed(marks(4 * S + jump_ns, 5 * S, epochs=[4, 5]), agree, flown())
    assert found == [False, True] and state.refused == 0


@pytest.mark.parametrize("jump_s", [1, 18, 1200, 3600, WEEK_S, 1023 * WEEK_S, 1024 * WEEK_S])
def test_a_jump_is_believed_only_where_satellites_show_it(jump_s):
    ahead = marks(*((4 + k + jump_s) * S for k in range(3)), epochs=range(4, 7))
    assert believed(ahead, False, flown())[1] == [False] * 3
    state, found = believed(ahead, True, flown())
    assert found == [True] * 3 and state.interval_ns == S


@pytest.mark.parametrize("agree", [True, False])
def test_none_goes_back_or_stands(agree):
    back = [*marks(2 * S, epochs=[5]), *marks(4 * S, epochs=[2]), *marks(3 * S, epochs=[3])]
    assert believed(back, agree, flown())[1] == [False] * 3


def test_a_first_one_that_is_wrong_is_got_rid_of():
    """After five minutes; what follows it is then what counts."""
    state = believed(marks(-WEEK_S * S, S - WEEK_S * S, 2 * S - WEEK_S * S))[0]
    right = marks(*(k * S for k in range(3, 400)), epochs=range(3, 400))
    state, found = believed(right, False, state)
    assert found.index(True) == DOUBTED_S and all(found[int(DOUBTED_S) :])
    assert state.interval_ns == S


def test_what_is_doubted_is_so_in_a_row():
    """One of two marks is wrong: it is never believed, however long that lasts."""
    state = flown()
    for k in range(4, 1000):
        state, yes = advanced(state, *marks(k * S + (k % 2) * S * 50, epochs=[k]), False)
        assert yes == (k % 2 == 0)


def test_the_interval_is_known_when_two_advances_are_the_same():
    """Until then a mark is believed whatever it says: the first may have been late."""
    advances = (3 * S, S, S, S)
    state, found = believed(marks(0, *accumulate(advances)))
    assert all(found) and state.interval_ns == S
    assert believed(marks(0, 3 * S, 4 * S))[0].interval_ns == 0
