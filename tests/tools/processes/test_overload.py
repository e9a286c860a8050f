"""A pace that was not kept is told."""

from __future__ import annotations

import pytest

from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.processes.overload import notes

pytestmark = pytest.mark.verifies(
    "tools/processes/overload.py",
    what="Overload, told",
    by="figures of runs that kept their pace and of others; the limits are ours",
    status="modelled",
)


def outcome(wall_s: float, late_s: float | None, epochs: int = 100) -> Outcome:
    return Outcome(epochs, 0, wall_s, None, None, None, mark_late_s=late_s)


@pytest.mark.parametrize(
    ("pace", "interval_s", "wall_s", "late_s"),
    [
        ("lockstep", 1.0, 0.1, None),
        ("realtime", 1.0, 100.0, 0.9),
        ("x10", 1.0, 10.1, 0.099),
        ("x1000", 1.0, 0.15, 0.0005),
        ("realtime", 1.0, 0.0, None),
        ("x20", 1.0, 5.3, 0.003),
    ],
)
def test_a_pace_that_was_kept_is_no_word_worth(pace, interval_s, wall_s, late_s):
    assert notes(pace, interval_s, outcome(wall_s, late_s)) == []


@pytest.mark.parametrize(
    ("pace", "wall_s", "late_s", "words"),
    [
        ("x10", 10.0, 0.11, "up to 110 ms late, an epoch lasts 100 ms; reached 10 times real time"),
        ("x1000", 2.0, 0.0001, "reached 50 times real time"),
        ("realtime", 120.0, None, "overload: --pace realtime was not kept"),
    ],
)
def test_a_pace_that_was_not_kept_is_told_as_overload(pace, wall_s, late_s, words):
    (line,) = notes(pace, 1.0, outcome(wall_s, late_s))
    assert line.startswith("overload: ") and words in line
