"""Expectations of faults: what is met, what is missed, what is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.ledger import Stretch
from gnss_hil.emulator.faults.models import Expect
from gnss_hil.tools.results.detectors import Sign
from gnss_hil.tools.results.expectations import Fixes, finding, span, verdicts

pytestmark = pytest.mark.verifies(
    "tools/results/expectations.py",
    what="Faults: whether they led to what was expected",
    by="epochs, errors and checks made up by the test",
    status="validated",
)


def stretch(first: int, last: int, touched: int = 5, active: bool = True) -> Stretch:
    epochs, struck = last - first + 1, first if touched else -1
    return Stretch(0, 0, Direction.FLIGHT, active, first, last, epochs, touched, struck=struck)


def signs(seen: dict[str, list[int]] | None) -> list[Sign]:
    return [Sign(word, "RX1", np.array(epochs)) for word, epochs in (seen or {}).items()]


EPOCHS = np.arange(100)
FIXES = Fixes(EPOCHS, EPOCHS != 52, np.where(EPOCHS == 55, 30.0, np.where(EPOCHS == 61, 8.0, 1.0)))
FAULT = [stretch(50, 56), stretch(57, 60, active=False)]


def judged(seen=None, fault=FAULT, fixes=FIXES, **expected) -> dict[str, tuple[str, bool]]:
    expect = Expect(**expected)
    found = finding(expect, fault, fixes, signs(seen))
    return {one.key: (one.found, one.met) for one in verdicts(expect, found)}


@pytest.mark.parametrize(
    ("seen", "found"),
    [
        ({"silence": [51]}, ("silence after 1 epoch", True)),
        ({"silence": [54]}, ("silence after 4 epochs", False)),
        ({"silence": [20, 53], "mark": [52]}, ("mark after 2 epochs", True)),
        ({"silence": [20]}, ("not seen", False)),
        ({"silence": [64]}, ("not seen", False)),
        ({"range": [50]}, ("only range after 0 epochs", False)),
        ({"range": [50], "silence": [51]}, ("silence after 1 epoch", True)),
    ],
)
def test_detection_is_by_one_of_the_checks_in_time(seen, found):
    assert judged(seen, detected_by=("silence", "mark"), within_epochs=3)["detected_by"] == found


def test_nothing_may_be_what_is_expected():
    assert judged(detected_by="none")["detected_by"] == ("not seen", True)
    assert judged({"silence": [51]}, detected_by="none")["detected_by"] == ("silence after 1 epoch", False)
    assert judged({"silence": [45, 51]}, detected_by="none")["detected_by"] == ("not seen", True)
    assert judged(detected_by=("none", "range"))["detected_by"] == ("not seen", True)


@pytest.mark.parametrize(("limit", "met"), [(29, False), (30, True)])
def test_errors_count_while_it_lasts_and_as_long_behind(limit, met):
    assert judged(fix_error_m=limit)["fix_error_m"] == ("30", met)
    behind = Fixes(EPOCHS, FIXES.valid, np.where(EPOCHS == 63, 99.0, 1.0))
    assert judged(fixes=behind, fix_error_m=5)["fix_error_m"] == ("99", False)
    later = Fixes(EPOCHS, FIXES.valid, np.where(EPOCHS == 64, 99.0, 1.0))
    assert judged(fixes=later, fix_error_m=5)["fix_error_m"] == ("1", True)


def test_a_fix_of_which_the_error_is_not_known_is_not_good_enough():
    """Of a mark 1,024 weeks off; one that is known to be too far off is told first, none later counts."""
    lost = Fixes(EPOCHS, FIXES.valid, np.where(EPOCHS == 55, np.nan, 8.0))
    assert judged(fixes=lost, fix_error_m=10)["fix_error_m"] == ("not known of 1 fix", False)
    assert judged(fixes=lost, fix_error_m=5)["fix_error_m"] == ("8", False)
    later = Fixes(EPOCHS, FIXES.valid, np.where(EPOCHS == 64, np.nan, 8.0))
    assert judged(fixes=later, fix_error_m=10)["fix_error_m"] == ("8", True)


def test_no_fix_errs_by_nothing_and_is_not_available():
    none = Fixes(EPOCHS, np.zeros(100, bool), np.full(100, np.nan))
    found = judged(fixes=none, fix_error_m=5, availability=0.1)
    assert found == {"fix_error_m": ("no fix", True), "availability": ("0", False)}


def test_where_nothing_is_expected_any_check_may_see_it_that_was_quiet_before():
    found = finding(Expect(), FAULT, FIXES, signs({"silence": [45, 50], "mark": [20, 52], "lost": [64]}))
    assert (found.detected_by, found.after_epochs) == ("mark", 2)
    assert finding(Expect(), FAULT, FIXES, signs({"lost": [64]})).detected_by is None, "after its time"


def test_of_what_is_seen_at_once_the_nearest_to_the_cause_is_told():
    found = finding(Expect(), FAULT, FIXES, signs({"silence": [50], "timeout": [50], "corrupted": [50, 51]}))
    assert (found.detected_by, found.after_epochs) == ("corrupted", 0)


def test_what_goes_on_from_before_did_not_see_it_but_elsewhere_it_may():
    assert judged({"silence": [49, 50, 51]}, detected_by="silence")["detected_by"] == ("not seen", False)
    assert judged({"silence": [48, 51]}, detected_by="silence")["detected_by"] == ("not seen", False)
    both = [Sign("silence", "RX1", np.array([49, 50])), Sign("silence", "RX2", np.array([51]))]
    assert finding(Expect(detected_by="silence"), FAULT, FIXES, both).after_epochs == 1


def test_what_another_fault_led_to_before_is_not_the_usual():
    """The same check of the same place, of a fault before; but not if it goes on, or if nothing explains
    it."""
    seen = signs({"silence": [44, 45, 50]})
    told = Expect(detected_by="silence")
    assert finding(told, FAULT, FIXES, seen).detected_by is None
    assert finding(told, FAULT, FIXES, seen, others=[(44, 45)]).expected_after_epochs == 0
    assert finding(told, FAULT, FIXES, seen, others=[(30, 35)]).detected_by is None
    assert finding(told, FAULT, FIXES, seen, others=[(42, 43)]).detected_by == "silence", "as long behind it"
    on = signs({"silence": [48, 49, 50]})
    assert finding(told, FAULT, FIXES, on, others=[(48, 60)]).detected_by is None


def test_who_saw_it_and_who_was_to_are_two_things():
    seen = signs({"silence": [50], "restart": [53], "mark": [40]})
    found = finding(Expect(detected_by=("restart", "mark")), FAULT, FIXES, seen)
    assert (found.detected_by, found.after_epochs) == ("silence", 0)
    assert (found.expected_by, found.expected_after_epochs) == ("restart", 3)
    found = finding(Expect(detected_by="mark"), FAULT, FIXES, signs({"silence": [50]}))
    assert (found.detected_by, found.expected_by, found.expected_after_epochs) == ("silence", None, None)


def test_availability_is_of_the_epochs_while_it_lasts():
    answered = EPOCHS != 53
    unanswered = Fixes(EPOCHS[answered], FIXES.valid[answered], FIXES.error_m[answered])
    assert judged(fixes=unanswered, availability=0.8)["availability"] == ("0.7143", False)
    assert judged(availability=6 / 7)["availability"] == ("0.8571", True)
    assert judged(availability=0.9)["availability"] == ("0.8571", False)


def test_a_fault_that_never_touched_a_frame_meets_nothing():
    idle = [stretch(50, 56, touched=0), stretch(57, 60, active=False)]
    assert span(idle) is None and span(idle, frames=False) == (50, 56)
    late = [replace(stretch(50, 56), struck=53), stretch(58, 59)]
    assert span(late) == (53, 59) and span(late, frames=False) == (50, 59)
    found = judged(fault=idle, detected_by="none", fix_error_m=5, availability=0)
    assert set(found.values()) == {("never acted", False)}


def test_quiet_is_as_long_before_a_fault_as_it_lasts():
    """A check that speaks every fifteen epochs anyhow did not see a fault of twenty."""
    found = finding(Expect(), [stretch(50, 69)], FIXES, signs({"silence": [20, 35, 50, 65], "mark": [60]}))
    assert found.detected_by == "mark"


def test_an_epoch_with_two_fixes_is_available_once():
    """A second flight computer answers too."""
    twice = Fixes(EPOCHS.repeat(2), FIXES.valid.repeat(2), FIXES.error_m.repeat(2))
    assert judged(fixes=twice, availability=0.9)["availability"] == ("0.8571", False)
