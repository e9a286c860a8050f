"""The ledger: stretches of events, and lines that are read back after a crash."""

from __future__ import annotations

import json

import pytest

from gnss_hil.emulator.faults import ledger
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.engine import Event
from tests.support.faulted import plan_of, strike

pytestmark = pytest.mark.verifies(
    "emulator/faults/ledger.py",
    "tools/results/faults.py",
    what="Faults: the ledger of what they did",
    by="frames counted in the run",
    status="validated",
)


def events(line: str):
    return [(0, event) for one in strike(line) for event in one.events]


def rows(line: str) -> list[tuple]:
    return [
        (s.direction.value, s.active, s.first, s.last, s.epochs, s.touched)
        for s in ledger.stretches(events(line))
    ]


def test_a_window_is_a_row_and_a_period_is_many():
    assert rows("ATT loss @100+5") == [("flight", True, 100, 104, 5, 20)]
    assert rows("ATT loss @100+20 every=10 on=2") == [
        ("flight", True, 100, 101, 2, 8), ("flight", True, 110, 111, 2, 8),
    ]  # fmt: skip


def test_what_is_still_done_behind_the_window_is_a_row_that_is_not_active():
    assert rows("ATT restart @100+5") == [
        ("flight", True, 100, 104, 5, 20),
        ("flight", False, 105, 129, 25, 100),
    ]


def test_directions_have_rows_of_their_own():
    found = rows("rx2 off @30..50")
    assert [row[0] for row in found] == ["flight", "receivers"] and found[1][5] > 0


def test_lines_are_read_back_and_one_cut_short_is_left_out():
    plan, given = plan_of("ATT loss @100+5 name=quiet"), events("ATT loss @100+5")
    lines = [ledger.header([plan]), *(ledger.line(craft, event) for craft, event in given)]
    armed, found = ledger.read([*lines, '[0,0,105,1,"fli'])
    assert list(found) == given
    assert armed == [{"craft": "soyuz", "faults": [{"name": "quiet", "kind": "loss", "place": "ATT"}]}]
    assert all(json.loads(line) for line in lines)


def test_who_acts_is_named_once_and_not_behind_its_window():
    plan = plan_of("rx2 off @30..50 reacquire_s=5 name=off", "ATT loss @45+10 name=quiet")
    struck = strike("rx2 off @30..50 reacquire_s=5 name=off", "ATT loss @45+10 name=quiet")
    named = {k: ledger.acting([plan], [struck[k].events]) for k in (29, 30, 46, 52, 60)}
    assert named == {29: [], 30: ["off"], 46: ["off", "quiet"], 52: ["quiet"], 60: []}


def test_an_event_has_its_own_epoch_and_count():
    assert ledger.stretches([(1, Event(2, 9, 0, Direction.FLIGHT, 9, 3, 2))])[0] == ledger.Stretch(
        1, 2, Direction.FLIGHT, True, 9, 9, 1, 3, 2, 9
    )


def test_the_first_epoch_in_which_frames_were_struck_is_told():
    quiet, struck = (
        ledger.Stretch,
        [one.struck for one in ledger.stretches(events("rx2 command-lost @20..60"))],
    )
    assert quiet(0, 0, Direction.FLIGHT, True, 1, 1, 1, 0).struck == -1
    touched = [event.epoch for _, event in events("rx2 command-lost @20..60") if event.touched]
    assert struck == [touched[0]] and touched[0] > 20, "there are no commands before the first fix"


def test_frames_are_missing_where_fewer_are_left_than_there_were():
    missing = {
        line: sum(event.missing for _, event in events(line))
        for line in ("ATT loss @100+5", "ATT corruption @100+5", "ATT repetition @100+5", "ATT delay @100+5")
    }
    assert list(missing.values()) == [20, 0, 0, 4], "a delay holds back the first epoch's; then one for one"


def test_epochs_in_which_a_fault_did_nothing_part_stretches():
    given = [Event(0, epoch, epoch, Direction.FLIGHT, since=1, touched=1) for epoch in (1, 2, 5, 6)]
    found = ledger.stretches((0, event) for event in given)
    assert [(one.first, one.last, one.epochs, one.touched) for one in found] == [(1, 2, 2, 2), (5, 6, 2, 2)]
