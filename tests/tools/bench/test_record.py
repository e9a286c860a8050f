"""The record of a run: its tables, its errors against truth, what was detected."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import gnss_hil
from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main
from tests.support.hurt_logs import Log

pytestmark = pytest.mark.verifies(
    "tools/bench/record.py",
    "tools/bench/detection.py",
    what="The record of a run for programs",
    by="the summary, and faults written into a log by hand",
    status="validated",
)

DURATION_S, FIRST_FIX_S = 130, 36


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> gnss_hil.Run:
    out = tmp_path_factory.mktemp("runs") / "a"
    return gnss_hil.run("soyuz", duration=DURATION_S, bus="inline", out=out, report=False)


@pytest.fixture(scope="module")
def hurt(run, tmp_path_factory) -> gnss_hil.Run:
    """The same, of whose second receiver nothing is heard for five epochs, and one frame twice."""
    folder = tmp_path_factory.mktemp("runs") / "hurt"
    shutil.copytree(run.folder, folder)
    log = Log(folder)
    for epoch in range(110, 115):
        log.take_out(epoch, lambda line: "RX2" in log.message(line).senders)
    at = log.row(120, "RX1_RATE")
    log.epochs[120][at:at] = 2 * [log.epochs[120][at]]
    log.written([])
    assert main(["report", str(folder)]) == 0
    return gnss_hil.Run.read(folder)


def test_tables_are_those_of_the_folder(run):
    for name in ("fixes", "truth", "epochs", "channels", "assignments", "checks"):
        table = getattr(run, name)
        assert table.equals(pl.read_parquet(run.folder / f"{name}.parquet"))
        assert getattr(run, name) is table
    assert len(run.truth) == len(run.epochs) == DURATION_S
    assert run.status == "complete"


def test_errors_are_those_of_the_summary(run):
    figures = run.summary["craft"]["soyuz"]
    for kind, unit in (("position", "m"), ("velocity", "mps")):
        column, name = run.errors[f"{kind}_error_{unit}"], f"{kind}_error_{unit}"
        assert len(column) == figures["fixes"] == DURATION_S - FIRST_FIX_S
        for told, rows in ((figures, run.errors), (figures["converged"], run.errors.filter("converged"))):
            assert rows[name].max() == pytest.approx(told[name]["max"], rel=1e-6)
            assert rows[name].median() == pytest.approx(told[name]["median"], rel=1e-6)
    assert run.errors["t_s"].to_list() == list(range(FIRST_FIX_S, DURATION_S))
    assert run.fix_error_m.shape == (DURATION_S - FIRST_FIX_S - 60,)
    assert run.fix_error_m.dtype == np.float64
    assert run.fix_error_m.max() == pytest.approx(figures["converged"]["position_error_m"]["max"], rel=1e-6)
    assert run.errors["position_error_m"].max() > 5 > run.fix_error_m.max()  # the cold start is left out
    assert run.availability == 1.0


def test_fixes_under_wrong_marks_err_against_the_truth_at_their_time(run, tmp_path):
    """Marks 0.3 s ahead, and 1,024 weeks back: of fixes after convergence all the same."""
    for name in ("fixes", "truth", "epochs"):
        shutil.copy(run.folder / f"{name}.parquet", tmp_path)
    shutil.copy(run.folder / "summary.json", tmp_path)
    shift_s = pl.when(pl.col("epoch") == 120).then(0.3).when(pl.col("epoch") == 121).then(-1024.0 * 604_800)
    fixes = run.fixes.with_columns(pl.col("t_gps_s") + shift_s.otherwise(0.0))
    fixes.write_parquet(tmp_path / "fixes.parquet")
    found, before = gnss_hil.Run.read(tmp_path).errors, run.errors
    assert found["converged"].to_list() == before["converged"].to_list()
    apart = found["position_error_m"].to_numpy() - before["position_error_m"].to_numpy()
    assert apart[120 - FIRST_FIX_S] == pytest.approx(2209, abs=3) and np.isnan(apart[121 - FIRST_FIX_S])
    assert np.count_nonzero(apart) == 2
    assert not gnss_hil.Run.read(tmp_path).fix_error_m.max() < 5


def test_epochs_without_a_fix_count_as_unavailable(run, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(run.folder, folder)
    log = Log(folder)
    for epoch in (100, 110, 120):
        log.take_out(epoch, lambda line: log.name(line) == "NAV_STATUS")
    log.written([])
    assert main(["report", str(folder)]) == 0
    lacking = gnss_hil.Run.read(folder)
    assert lacking.availability == pytest.approx(1 - 3 / (DURATION_S - FIRST_FIX_S - 60))
    assert len(lacking.fix_error_m) == len(run.fix_error_m) - 3
    assert lacking.detected("not_reported")


def test_what_was_refused_and_where(run, hurt):
    assert run.rejected.is_empty()
    gone = Counter(hurt.rejected.select("reason", "where", "count").rows())
    assert gone["REPEATED", "RX1_RATE", 2] == 1
    assert sum(hurt.rejected["count"]) == sum(hurt.summary["frames"]["rejected"].values())
    assert hurt.rejected["count"].is_sorted(descending=True)


@pytest.mark.parametrize(
    ("check", "where", "seen"),
    [
        ("silence", None, True), ("silence", "RX2", True), ("silence", "rx2", True),
        ("silence", "RX1", False),
        ("repeated", None, True), ("REPEATED", "RX1", True), ("repeated", "RX1_RATE", True),
        ("repeated", "RX1_RANGE", False), ("wrong sequence", "RX2", True), ("wrong-sequence", "RX1", False),
        ("too_few_satellites", None, True), ("corrupted", None, False), ("mixed_epoch", None, False),
    ],
)  # fmt: skip
def test_checks_are_asked_by_name_and_place(hurt, check, where, seen):
    assert hurt.detected(check, where=where) is seen


def test_a_check_that_there_is_not_is_told(run):
    with pytest.raises(gnss_hil.BenchError, match="check 'silense': not known; did you mean 'silence'"):
        run.detected("silense")
    with pytest.raises(gnss_hil.BenchError, match="check 'none': not known"):
        run.detected("none")  # a word of faults' detected_by that means no check
    assert not run.detected("innovation")


def test_one_craft_of_two(tmp_path):
    run = gnss_hil.run("pair", duration=60, bus="inline", out=tmp_path / "pair", report=False)
    first, second = run.summary["craft"]
    assert set(run.fixes["craft"]) == {first, second}
    alone = run.of(second)
    assert set(alone.fixes["craft"]) == set(alone.errors["craft"]) == {second}
    assert len(run.errors) == len(alone.errors) + len(run.of(first).errors)
    with pytest.raises(gnss_hil.BenchError, match="not in this run; did you mean"):
        run.of(second + "x")
    with pytest.raises(gnss_hil.BenchError, match="over before convergence, 60 s after the first fix"):
        run.fix_error_m  # noqa: B018
    with pytest.raises(gnss_hil.BenchError, match="over before convergence"):
        alone.availability  # noqa: B018


def test_without_a_fix_nothing_is_available(tmp_path):
    run = gnss_hil.run("soyuz", duration=10, bus="inline", out=tmp_path / "a", log=False, report=False)
    assert run.availability == 0.0
    assert run.errors.is_empty()
    with pytest.raises(gnss_hil.BenchError, match="there was no fix of 10 s"):
        run.fix_error_m  # noqa: B018
    with pytest.raises(gnss_hil.BenchError, match=r"has no channels\.parquet"):
        run.channels  # noqa: B018
    with pytest.raises(gnss_hil.BenchError, match=r"has no bus\.log"):
        run.report  # noqa: B018


def test_expectations_are_a_table(tmp_path):
    text = (
        shipped()["soyuz"]
        .read_text()
        .replace(
            "[time]", '[expect]\n"soyuz.fixes" = {min = 1}\n"soyuz.pdop.median" = {max = 0.01}\n\n[time]'
        )
    )
    (tmp_path / "judged.toml").write_text(text)
    run = gnss_hil.run(tmp_path / "judged.toml", duration=45, bus="inline", out=tmp_path / "a", report=False)
    assert run.expectations["met"].to_list() == [True, False]
    assert run.expectations.columns == ["name", "min", "max", "after_s", "found", "met"]
    (line,) = run.missed
    assert line.startswith("expectation missed: soyuz.pdop.median: found ")
    assert run.failures == ()


def test_a_report_is_drawn_when_it_is_asked_for(hurt, capsys):
    assert not (hurt.folder / "report.html").exists() or (hurt.folder / "report.html").unlink() is None
    assert hurt.report == hurt.folder / "report.html"
    before = hurt.report.stat()
    assert hurt.report.stat().st_mtime_ns == before.st_mtime_ns and before.st_size > 100_000
    assert capsys.readouterr().out == ""


def test_a_folder_that_is_no_run_is_told(run, tmp_path):
    with pytest.raises(gnss_hil.BenchError, match=r"nowhere: has no summary\.json"):
        gnss_hil.Run.read(tmp_path / "nowhere")
    shutil.copy(run.folder / "summary.json", tmp_path)
    (tmp_path / "fixes.parquet").write_bytes(b"PAR1")
    damaged = gnss_hil.Run.read(tmp_path)
    with pytest.raises(gnss_hil.BenchError, match=r"fixes\.parquet: "):
        damaged.fixes  # noqa: B018
    assert damaged.command == ""
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(gnss_hil.BenchError, match=r"summary\.json: is damaged"):
        gnss_hil.Run.read(tmp_path)
    assert json.loads((Path(run.folder) / "summary.json").read_text()) == run.summary


@pytest.fixture(scope="module")
def faulty(tmp_path_factory) -> gnss_hil.Run:
    faults = ["rx2 off @110+10s", "rx1 RATE loss @115 n=1"]
    out = tmp_path_factory.mktemp("runs") / "a"
    return gnss_hil.run("soyuz", faults=faults, duration=130, bus="inline", out=out, report=False)


def test_a_receiver_that_is_off_is_noticed_in_its_first_epoch(tmp_path):
    run = gnss_hil.run(
        "soyuz", faults=["rx2 off @2m+30s"], duration="3m", bus="inline", out=tmp_path / "a", report=False
    )
    assert run.detected("silence", within=2)
    assert run.detected("silence", within=0, where="RX2")
    assert not run.detected("silence", within=60, where="RX1")
    assert not run.detected("too_few_satellites", within=200)  # of the cold start, before it
    assert run.detected("too_few_satellites")
    assert run.fix_error_m.max() < 5
    silent = run.checks.filter(check="SILENCE")
    assert silent["epoch"].to_list() == list(range(120, 150))
    first = run.faults.filter("active")["first_epoch"]
    assert first.unique().to_list() == [120]


def test_of_several_faults_one_is_named(faulty):
    off, loss = faulty.faults["fault"].unique(maintain_order=True)
    assert faulty.detected("silence", fault=off, within=0)
    assert not faulty.detected("corrupted", fault=off)
    assert faulty.detected("lost", fault=loss, within=1, where="RX1_RATE")
    assert not faulty.detected("lost", fault=loss, within=0, where="RX1_RATE")
    with pytest.raises(gnss_hil.BenchError, match=f"which of 2[?] '{off}', '{loss}'"):
        faulty.detected("silence", within=2)
    with pytest.raises(gnss_hil.BenchError, match=f"never acted in this run; did you mean '{off}'"):
        faulty.detected("silence", fault=off[:-2] + "x")


def test_a_fault_in_whose_window_no_frame_came_never_acted(tmp_path):
    """Its window came, and G07 was not tracked yet: `not detected` must not pass for that."""
    faults = ["G07 range +30 m @0..2 name=early", "jammer @20..30 name=jammer"]
    run = gnss_hil.run(
        "soyuz", faults=faults, duration=40, bus="inline", out=tmp_path / "a", report=False, log=False
    )
    assert "early" in run.faults["fault"].to_list(), "a stretch without a frame"
    with pytest.raises(gnss_hil.BenchError, match="'early': never acted in this run; no frame was at its"):
        run.detected("exclusion", within=2, fault="early")
    assert not run.detected("corrupted", within=2, fault="jammer"), "which acts elsewhere"


@pytest.mark.parametrize(
    ("where", "told"),
    [("RX9", "no such place; did you mean 'RX"), ("G99", "no such place"), ("RX2_RNGE", "mean 'RX2_RANGE'"),
     ("starbord", "did you mean 'starboard'"), ("RANGE", "no such place"), ("", "no such place")],
)  # fmt: skip
def test_a_place_that_there_is_not_is_told(faulty, where, told):
    with pytest.raises(gnss_hil.BenchError, match=re.escape(told)):
        faulty.detected("silence", where=where)


@pytest.mark.parametrize(
    ("where", "seen"),
    [("starboard", True), ("RX2", True), ("rx1", False), ("aft", False), ("ATT", False), ("G07", False),
     ("0x3a5", False), ("BENCH", False), ("RX2_RANGE", False)],
)  # fmt: skip
def test_an_antenna_is_its_receiver(faulty, where, seen):
    off = faulty.faults["fault"][0]
    assert faulty.detected("silence", fault=off, where=where) is seen


def test_without_a_fault_nothing_is_within(run):
    assert run.faults.is_empty()
    with pytest.raises(gnss_hil.BenchError, match="counts from a fault, and none acted"):
        run.detected("silence", within=2)
    with pytest.raises(gnss_hil.BenchError, match="fault 'a': never acted in this run; none did"):
        run.detected("silence", fault="a")


def test_lost_acknowledgements_restarts_and_marks_are_seen(tmp_path):
    for fault, check, where in (
        ("ack-lost @30+20s", "no-answer", "RX1"),
        ("rx3 reset @60+5s", "restart", "RX3"),
        ("mark-missing @70 n=1", "mark", "TIME"),
    ):
        out = tmp_path / check
        run = gnss_hil.run(
            "soyuz", faults=[fault], duration=100, bus="inline", out=out, report=False, log=False
        )
        assert run.detected(check, within=10, where=where), fault


def test_a_fault_that_cannot_be_is_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(gnss_hil.BenchError, match="rx9") as caught:
        gnss_hil.run("soyuz", faults=["rx9 off @2m+30s"], out="run")
    assert caught.value.status == 2
    assert not list(tmp_path.iterdir())
