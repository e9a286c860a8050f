"""Faults in the live view: a file that grows, read as it grows, and the line that is drawn of it."""

from __future__ import annotations

import pytest

from gnss_hil.emulator.faults import ledger
from gnss_hil.tools.live.layout import screen
from gnss_hil.tools.live.live_faults import FRESH_S, LiveFaults
from gnss_hil.tools.live.screen import plain
from gnss_hil.tools.live.summary import FaultsSummary, RunSummary
from tests.support.faulted import plan_of, strike
from tests.tools.live.test_view import Window, viewed

pytestmark = pytest.mark.verifies(
    "tools/live/live_faults.py",
    what="Live view: faults that are armed and that act",
    by="the lines of faults let loose on a real run, written piece by piece",
    status="validated",
)

LINES = ("ATT loss @100+5 name=quiet", "rx2 off @103+4 name=off", "rx1 loss @1h name=late")


@pytest.fixture
def grown(tmp_path):
    """A function that brings the file up to an epoch, and its reader."""
    path, plan = tmp_path / "faults", plan_of(*LINES)
    events = [event for one in strike(*LINES) for event in one.events]
    reader = LiveFaults(path, [plan])

    def grow(epoch: int, cut: int = 0) -> None:
        text = ledger.header([plan])
        text += "".join(ledger.line(0, event) for event in events if event.epoch <= epoch)
        path.write_text(text[: len(text) - cut])

    yield grow, reader
    reader.close()


def test_each_is_armed_then_acts_then_is_over(grown):
    grow, faults = grown
    assert faults.look(0.0) == FaultsSummary((), (), ("quiet", "off", "late")), "there is no file yet"
    grow(99)
    assert faults.look(1.0) == FaultsSummary((), (), ("quiet", "off", "late"))
    grow(100)
    assert faults.look(2.0) == FaultsSummary(("quiet",), (), ("off", "late"))
    grow(104)
    assert faults.look(3.0).acting == ("quiet", "off")
    grow(106)
    faults.look(4.0)
    assert faults.look(4.0 + FRESH_S) == FaultsSummary((), ("quiet", "off"), ("late",))


def test_where_no_frame_comes_none_acts(tmp_path):
    """A channel that tracks nothing yet; a jammer touches no frame and acts all the same."""
    lines = ("rx3 ch0 loss @3+4 name=early", "jammer @3+4 name=jammer")
    path, plan = tmp_path / "faults", plan_of(*lines)
    events = [event for one in strike(*lines) for event in one.events if event.epoch < 6]
    assert {event.fault for event in events} == {0, 1}
    path.write_text(ledger.header([plan]) + "".join(ledger.line(0, event) for event in events))
    reader = LiveFaults(path, [plan])
    assert reader.look(0.0) == FaultsSummary(("jammer",), (), ("early",))
    reader.close()


def test_a_line_cut_short_waits_for_its_end(grown):
    grow, faults = grown
    grow(100, cut=5)
    assert faults.look(1.0).acting == ()
    grow(100)
    assert faults.look(2.0).acting == ("quiet",)


def test_a_file_of_which_the_first_line_is_not_whole_is_opened_again(grown, tmp_path):
    grow, faults = grown
    (tmp_path / "faults").write_text('{"arm')
    assert faults.look(1.0).armed == ("quiet", "off", "late")
    grow(100)
    assert faults.look(2.0).acting == ("quiet",)


def test_without_faults_there_is_nothing(tmp_path):
    assert LiveFaults(tmp_path / "faults", []).look(0.0) is None


def test_they_have_one_line_on_the_screen(tmp_path):
    view = viewed(tmp_path, Window(80, 24))
    craft = tuple(one.look() for one in view._craft)
    told = FaultsSummary(("quiet",), ("off",), ("late",))
    rows = [RunSummary("x", 1, 1.0, 2.0, None, 0, craft, faults=faults) for faults in (None, told)]
    without, within = ([plain(spans) for spans in screen(run, 80, 24)] for run in rows)
    (line,) = [text for text in within if text.startswith("faults")]
    assert line.split() == ["faults", "acting:", "quiet", "over:", "off", "armed:", "late"]
    assert not [text for text in without if text.startswith("faults")]
    assert len(within) <= 24 and all(len(text) <= 80 for text in within)
