"""Commands and faults in time: a mark for each, in the lane of its antenna."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.tools.report.events import events
from tests.support.plots import T0_NS, craft

pytestmark = pytest.mark.verifies(
    "tools/report/events.py", what="Report: commands and faults", by="log made by hand", status="modelled"
)

ROWS = (
    (3, "command", 1, 0, "TRACK", "G01", 1, ""),
    (4, "ack", 1, 0, "", "G01", 1, "ACCEPTED"),
    (5, "command", 2, 3, "RELEASE", "", 2, ""),
    (6, "repeat", 2, 3, "RELEASE", "", 2, ""),
    (7, "ack", 2, 3, "", "", 2, "NO_SUCH_CHANNEL"),
    (8, "command", 9, 0, "TRACK", "G02", 1, ""),
)
NAMES = ("t_ns", "event", "receiver", "channel", "action", "satellite", "transaction", "result")


def drawn(rows=ROWS, faults=()):
    log = {name: np.array([row[k] for row in rows]) for k, name in enumerate(NAMES)}
    log["t_ns"] = T0_NS + log["t_ns"].astype(np.int64) * 10**9
    counts = np.zeros(20)
    counts[list(faults)] = 2
    vehicle = SimpleNamespace(names=("fore", "aft"))
    return events(craft(20, commands=log, counts={"faults": counts}, vehicle=vehicle))


def test_every_kind_has_its_marks_in_the_lane_of_its_antenna():
    plot = drawn(faults=(9, 10))
    assert [(trace["name"], trace["y"]) for trace in plot.figure["data"]] == [
        ("track: 1", [0]), ("release: 1", [1]), ("repeat: 1", [1]), ("refused: 1", [1]),
        ("epochs with refused frames: 2", [2, 2]),
    ]  # fmt: skip
    assert plot.figure["data"][3]["text"] == ["refused channel 3 NO_SUCH_CHANNEL"]
    assert plot.figure["layout"]["yaxis"]["ticktext"] == ["fore", "aft", "frames"]
    assert drawn().figure["layout"]["yaxis"]["ticktext"] == ["fore", "aft"]


def test_a_run_without_any_says_so():
    assert "Nothing was commanded" in drawn(rows=()).note


def test_very_many_are_thinned_and_counted():
    plot = drawn(rows=ROWS[:1] * 4000)
    assert len(plot.figure["data"][0]["y"]) == 1500 and "2500 marks are not drawn" in plot.note
    assert plot.figure["data"][0]["name"] == "track: 4000"
