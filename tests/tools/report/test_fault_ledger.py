"""Faults in the report: the ledger's cells, and windows in plots over time."""

from __future__ import annotations

import json

import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.report import fault_ledger
from gnss_hil.tools.report.plot import Plot, axis, layout
from gnss_hil.tools.results import assemble, faults

pytestmark = pytest.mark.verifies(
    "tools/report/fault_ledger.py",
    what="Faults in the report: the ledger, windows in plots",
    by="the summary of a run, and its scenario's times",
    status="validated",
)

LINES = (
    "rx2 crc wrong @100+4 name=crc detected_by=corrupted", "G07 range +30 m @100+6 every=3 on=1 name=step",
    "ATT loss @1h name=never detected_by=lost", "rx1 loss @110+2", "rx3 ch0 loss @3+3 name=early",
)  # fmt: skip
BEGIN_MS = 1_351_642_500_000
"""2012-10-31 00:15:00, soyuz's first epoch, on a calendar that runs with GPS time."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "run"
    faults = [word for line in LINES for word in ("--fault", line)]
    more = ["--duration", "120", "--bus", "inline", "--no-report", "--quiet", "--out", str(path)]
    assert main(["run", "soyuz", *faults, *more]) == 1, (
        "what is expected of a fault that never acts is missed"
    )
    return path


@pytest.fixture(scope="module")
def windows(folder):
    scenario, _ = assemble.read_scenario(folder)
    return fault_ledger.windows(folder, scenario, "soyuz")


def test_the_ledger_has_a_row_for_each_fault_and_says_what_was_missed(folder):
    summary = json.loads((folder / "summary.json").read_text())
    table, chain = fault_ledger.cards(folder, summary)
    assert table.count("<tr>") == 1 + len(LINES)
    for words in (
        "crc, rx2",
        "range-step, G07",
        "100..103",
        "corrupted",
        "never",
        "MISSED",
        "met",
        "110..111",
    ):
        assert words in table
    assert "<li>fault 'never' (ATT, craft soyuz) never acted" in table
    assert "From frame to fix" in chain and "frames touched" in chain
    assert fault_ledger.cards(folder, summary | {"faults": []}) == []
    assert "Red in plots" in table
    (idle,) = fault_ledger.cards(folder, summary | {"faults": summary["faults"][-1:]})
    assert "never" in idle and "Red in plots" not in idle


def test_a_window_in_which_no_frame_came_is_not_shaded(folder, windows):
    """It is on record, of a channel that tracked nothing yet; the ledger says never."""
    _, stretches = faults.read(folder)
    assert {one.touched for one in stretches if one.fault == 4} == {0}
    assert 5 not in {one.number for one in windows}


def test_windows_are_the_epochs_in_which_it_acted_by_the_ledgers_number(windows):
    seconds = [(one.number, one.begin_ns % 10**12 / 1e9, one.end_ns % 10**12 / 1e9) for one in windows]
    first = seconds[0][1]
    assert [(number, round(a - first, 3), round(b - first, 3)) for number, a, b in seconds] == [
        (1, 0, 4), (2, 0, 1), (2, 3, 4), (4, 10, 12),
    ]  # fmt: skip


def test_every_plot_over_time_is_shaded_and_no_other(windows):
    over_time = Plot(
        "a", "", {"data": [], "layout": layout(axis("", type="date"), axis(""), shapes=[{"type": "x"}])}
    )
    other = Plot("b", "", {"data": [], "layout": layout(axis(""), axis(""))})
    missing = Plot.missing("c", "why")
    found, same, none, nothing = fault_ledger.shaded([over_time, other, missing, None], windows)
    assert same is other and none is missing and nothing is None
    shapes = found.figure["layout"]["shapes"]
    assert shapes[0] == {"type": "x"} and {one["fillcolor"] for one in shapes[1:]} == {"--fault"}
    assert [(one["x0"] - BEGIN_MS, one["x1"] - BEGIN_MS) for one in shapes[1:]] == [
        (99_500, 103_500), (99_500, 100_500), (102_500, 103_500), (109_500, 111_500),
    ]  # fmt: skip
    told = [(one["text"], one["x"] - BEGIN_MS) for one in found.figure["layout"]["annotations"]]
    assert told == [("1, 2", 99_500), ("4", 109_500)], "those that begin together are named together"
    assert fault_ledger.shaded([over_time], []) == [over_time]
