"""Modes: the table of transitions is complete, and a flight goes through all of it."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.flightsw.app import modes
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.app.modes import GUIDANCE, NODE_STATE, TRANSITIONS, Event, Guidance, Mode, ModeOptions
from gnss_hil.flightsw.io.encode import NodeState
from gnss_hil.flightsw.records.solution import FixMode, NoFix, OrbitState, Solution
from tests.support.flights import AUTONOMOUS, SKY, drop, fly, soyuz
from tests.support.flown import FakeBus, decoded

pytestmark = pytest.mark.verifies(
    "flightsw/app/modes.py",
    what="Modes",
    by="rules of ours: the table is complete, every mode is reached and left in flight",
    status="modelled",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))


def test_every_mode_has_a_transition_for_every_event_and_its_guidance():
    assert set(TRANSITIONS) == set(GUIDANCE) == set(Mode)
    assert all(set(row) == set(Event) for row in TRANSITIONS.values())


def test_every_mode_is_reached_and_left():
    reached = {after for row in TRANSITIONS.values() for after in row.values()}
    assert reached == set(Mode)
    for mode, row in TRANSITIONS.items():
        assert (row[Event.NO_TIME] is mode) == (mode is not Mode.NAVIGATING), "there was no fix in it"
        assert row[Event.FIX] is Mode.NAVIGATING
        assert any(after is not mode for after in row.values())


@pytest.mark.parametrize(
    ("enum", "table"), [(NoFix, "NoFix"), (FixMode, "NavMode"), (NodeState, "NodeState")]
)
def test_words_on_the_bus_are_all_of_the_contracts_value_tables(enum, table):
    assert {word.value: word.name for word in enum} == VALUES[table]


def test_what_a_node_says_of_its_mode():
    """RUNNING is a fix, READY is waiting for time, and all between is DEGRADED."""
    assert set(NODE_STATE) == set(Mode)
    assert [mode for mode, state in NODE_STATE.items() if state is NodeState.RUNNING] == [Mode.NAVIGATING]
    assert [mode for mode, state in NODE_STATE.items() if state is NodeState.READY] == [Mode.STANDBY]
    assert set(NODE_STATE.values()) == {NodeState.READY, NodeState.RUNNING, NodeState.DEGRADED}


def test_the_heartbeat_says_what_the_mode_is():
    config = configure(SOYUZ, "patent")
    no_ranges, no_time = drop(["RANGE"], (1, 3)), drop(["TIME_FINE"], (0, 5))
    states, answers, _ = fly(
        FakeBus(soyuz(), SKY), config, 6, tamper=lambda epoch, block: no_time(epoch, no_ranges(epoch, block))
    )
    said = [NodeState(int(decoded(answer, "HEARTBEAT")["state"][0])).name for answer in answers]
    assert said == ["READY", "DEGRADED", "RUNNING", "DEGRADED", "RUNNING", "DEGRADED"]
    assert [state.mode.name for state in states] == [
        "STANDBY", "START", "NAVIGATING", "COASTING", "NAVIGATING", "COASTING",
    ]  # fmt: skip


def test_what_was_never_commanded_is_not_surrendered():
    assert TRANSITIONS[Mode.START][Event.OVERDUE] is TRANSITIONS[Mode.STANDBY][Event.OVERDUE] is Mode.START
    assert TRANSITIONS[Mode.SURRENDERED][Event.PROPAGATED] is Mode.SURRENDERED


def test_only_with_a_position_are_satellites_assigned():
    assert {mode for mode, what in GUIDANCE.items() if what is Guidance.ASSIGN} == {
        Mode.NAVIGATING,
        Mode.COASTING,
    }
    assert GUIDANCE[Mode.LOST] is Guidance.KEEP and GUIDANCE[Mode.SURRENDERED] is Guidance.RELEASE


@pytest.mark.parametrize(
    ("reason", "orbit", "epochs", "event"),
    [
        (NoFix.TOO_FEW_SATELLITES, True, 4, Event.PROPAGATED),
        (NoFix.TOO_FEW_SATELLITES, False, 4, Event.NO_POSITION),
        (NoFix.TOO_FEW_SATELLITES, True, 5, Event.OVERDUE),
        (NoFix.NO_TIME_MARK, True, 4, Event.NO_TIME),
        (NoFix.NO_TIME_MARK, False, 4, Event.NO_TIME),
        (NoFix.NO_TIME_MARK, True, 5, Event.OVERDUE),
    ],
)
def test_events_of_epochs_without_a_fix(reason, orbit, epochs, event):
    state = OrbitState(0, np.zeros(3), None, 0) if orbit else None
    solution = Solution(reason, None, state)
    assert modes.event_of(solution, epochs, ModeOptions(autonomy_after_epochs=5)) is event


def test_a_flight_through_the_modes():
    """Ranges from epoch 1 on, none in 6 to 8, no time mark in epoch 3; epoch 9 is out of sequence after the
    gap."""
    config = configure(SOYUZ, "patent", {"autonomy_after_epochs": 2})
    no_ranges, no_time = drop(["RANGE"], (0, *range(6, 9))), drop(["TIME_FINE"], [3])
    bus = FakeBus(soyuz(), SKY)
    states, *_ = fly(bus, config, 13, tamper=lambda epoch, block: no_time(epoch, no_ranges(epoch, block)))
    found = [state.mode for state in states]
    assert found[0] is Mode.START
    assert found[1:6] == [*[Mode.NAVIGATING] * 2, Mode.COASTING, *[Mode.NAVIGATING] * 2]
    assert states[3].solution.reason is NoFix.NO_TIME_MARK and states[3].solution.fix is None
    assert found[6] is Mode.COASTING
    assert found[7:10] == [Mode.SURRENDERED] * 3
    assert found[10:] == [Mode.NAVIGATING] * 3
    assert [state.without_fix for state in states[2:10]] == [0, 1, 0, 0, 1, 2, 3, 4]


def test_before_the_first_time_mark_nothing_is_overdue():
    config = configure(SOYUZ, "patent", {"autonomy_after_epochs": 2})
    states, *_ = fly(FakeBus(soyuz(), SKY), config, 5, tamper=drop(["TIME_FINE"], range(4)))
    assert [state.mode for state in states] == [*[Mode.STANDBY] * 4, Mode.NAVIGATING]
    assert [state.without_fix for state in states] == [0] * 5


def without_marks(first_epoch_with_ranges):
    """Six epochs with fixes, six without a time mark, six more with marks, ranges from an epoch on."""
    no_time = drop(["TIME_FINE"], range(6, 12))
    no_ranges = drop(["RANGE"], range(6, first_epoch_with_ranges))
    bus = FakeBus(soyuz(), SKY)
    config = configure(SOYUZ, "patent", {"autonomy_after_epochs": 4})
    states, *_ = fly(bus, config, 18, tamper=lambda epoch, block: no_time(epoch, no_ranges(epoch, block)))
    return states, {epoch for epoch, *_, action, _ in bus.commands if action == AUTONOMOUS}


@pytest.mark.slow
def test_without_time_marks_the_surrender_is_due_and_commanded_with_the_next_mark():
    states, freed = without_marks(18)
    assert [state.mode for state in states[5:12]] == [
        Mode.NAVIGATING,
        *[Mode.COASTING] * 3,
        *[Mode.SURRENDERED] * 3,
    ]
    assert [state.without_fix for state in states[5:12]] == list(range(7))
    marks = [epoch for epoch, state in enumerate(states) if state.mark.epoch == epoch]
    # The receivers hear a command of epoch k in epoch k + 1.
    assert freed == {min(epoch for epoch in marks if epoch >= 12) + 1}


@pytest.mark.slow
def test_a_fix_with_the_next_mark_undoes_the_surrender():
    states, freed = without_marks(6)
    assert states[11].mode is Mode.SURRENDERED and states[-1].mode is Mode.NAVIGATING
    assert not freed
