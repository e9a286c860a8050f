"""Pages of runs where something is missing, and where a page cannot be."""

from __future__ import annotations

import json
import re

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.report_pages import SKIES, TITLES, drawn, played, titles

pytestmark = pytest.mark.verifies(
    "tools/report/run_report.py",
    what="Pages of runs where something is missing",
    by="choice of ours",
    status="modelled",
)


def test_without_truth_the_page_says_so_and_draws_the_rest(copied, tmp_path, capsys):
    (copied / "truth").unlink()
    assert main(["report", str(copied)]) == 0
    assert capsys.readouterr().out.endswith(f"\nreport:     {copied}/report.html\n")
    text = (copied / "report.html").read_text("utf-8")
    assert "No truth was kept with this run" in text
    assert len(drawn(copied / "report.html", tmp_path)["plots"]) == len(TITLES) - 3


def test_without_a_log_the_page_shows_fixes_and_truth(tmp_path):
    folder = played(tmp_path / "bare", "--no-log")
    text = (folder / "report.html").read_text("utf-8")
    assert "has no table of channels" in text
    assert text.count("This run kept no table of channels") == 5
    assert "Not drawn" in text
    without = {"Assignment", "Carrier to noise density", "Residuals", "Satellites by antenna", *SKIES}
    assert titles(folder / "report.html") == [title for title in TITLES if title not in without]
    assert len(drawn(folder / "report.html", tmp_path)["plots"]) == len(TITLES) - len(without)


def test_a_run_without_a_fix_has_a_page(copied, tmp_path):
    """A flight software that never publishes: its frames are taken out of the record."""
    lines = (copied / "bus.log").read_bytes().splitlines(keepends=True)
    kept = [line for line in lines if not re.search(rb" can0 0[24]", line)]
    assert len(kept) < len(lines)
    (copied / "bus.log").write_bytes(b"".join(kept))
    assert main(["report", str(copied)]) == 0
    text = (copied / "report.html").read_text("utf-8")
    assert text.count("There is not one valid fix in this run.") == 5
    drawn(copied / "report.html", tmp_path)


def test_a_flight_software_that_sends_no_lists_is_not_shown_with_0_satellites(
    patent, copied, tmp_path, capsys
):
    lines = (copied / "bus.log").read_bytes().splitlines(keepends=True)
    kept = [line for line in lines if b" can0 04B#" not in line]
    assert len(kept) < len(lines)
    (copied / "bus.log").write_bytes(b"".join(kept))
    assert main(["report", str(copied)]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^  not sent +NAV_USED \(satellites as NAV_STATUS counts them\)$", out, re.MULTILINE)
    assert re.search(r"^  PDOP, each satellite once +-$", out, re.MULTILINE)
    whole, bare = (json.loads((folder / "summary.json").read_text()) for folder in (patent, copied))
    whole, bare = (s["craft"]["soyuz"]["satellites_tracked"] for s in (whole, bare))
    assert bare == whole and bare["min"] >= 4
    text = (copied / "report.html").read_text("utf-8")
    assert "Not sent with its fixes: NAV_USED" in text
    assert f"<b>{whole['mean']:.1f}</b><span>satellites in the fix" in text
    assert "rms of all, as fixes do not say" in text
    drawn(copied / "report.html", tmp_path)


def test_a_run_of_which_nothing_was_heard_has_a_page(copied, tmp_path):
    (copied / "bus.log").write_bytes(b"")
    assert main(["report", str(copied)]) == 0
    assert "No time mark was heard." in (copied / "report.html").read_text("utf-8")
    drawn(copied / "report.html", tmp_path)


def test_refused_frames_have_a_plot_and_a_table(copied, tmp_path):
    log = (copied / "bus.log").read_bytes().splitlines(keepends=True)
    at = [i for i, line in enumerate(log) if b" can0 100#" in line][10]
    log[at] = log[at][:-4] + (b"00" if log[at][-4:-2] != b"00" else b"11") + log[at][-2:]
    (copied / "bus.log").write_bytes(b"".join(log))
    assert main(["report", str(copied)]) == 0
    page = copied / "report.html"
    assert "refused: corrupted" in page.read_text("utf-8")
    assert titles(page) == [*TITLES, "Frames refused"]
    drawn(page, tmp_path)


def test_a_run_may_go_without_a_page(tmp_path, capsys):
    folder = played(tmp_path / "plain", "--no-report")
    assert not (folder / "report.html").exists()
    assert capsys.readouterr().out.endswith(f"run folder: {folder}\n"), "no line of a page"
    assert (
        main(["run", "soyuz", "--bus", "inline", "--duration", "9", "--no-report", "--out", f"{folder}2"])
        == 0
    )
    assert capsys.readouterr().out.endswith(f"run folder: {folder}2\n")


def test_a_page_that_cannot_be_written_costs_nothing_else(copied, capsys):
    (copied / "report.html").unlink()
    (copied / "report.html").mkdir()
    before = json.loads((copied / "summary.json").read_text())
    (copied / "summary.json").unlink()
    assert main(["report", str(copied)]) == 1
    written = capsys.readouterr()
    (line,) = written.err.splitlines()
    assert f"{copied}/report.html" in line and "summary.json" in line
    assert json.loads((copied / "summary.json").read_text()) == before
    assert not list(copied.glob(".*"))


def test_a_page_of_another_emulator_says_nothing_of_its_own(patent, copied):
    """The scenario asks for a craft in 2012; what flew is known from the bus alone."""
    text = (copied / "run.json").read_text().replace('"emulator": "ours"', '"emulator": "./theirs"')
    (copied / "run.json").write_text(text)
    scenario = (copied / "scenario.toml").read_text()
    (copied / "scenario.toml").write_text(scenario.replace("2012-10-31T00:15", "2020-01-01T00:00"))
    assert main(["report", str(copied)]) == 0
    page = (copied / "report.html").read_text("utf-8")
    assert "Emulator: ./theirs. What it played is known from the bus alone" in page
    assert "from 2012-10-31 00:15:00" in page and "2020-01-01" not in page.split("What was run")[0]
    assert "Soyuz MS in orbital attitude" not in page
    assert "as in the vehicle file handed over, soyuz-ms" in page


def test_a_page_is_not_written_where_it_cannot_be(patent, tmp_path, capsys):
    assert main(["report", str(patent), "--out", str(tmp_path / "nowhere" / "a.html")]) == 2
    assert main(["report", str(patent), "--out", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
