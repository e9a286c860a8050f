"""Whole runs through the command line, inline and as processes: folders, tables, figures, bytes."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import polars as pl
import pytest

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.run_config.plan import make
from tests.support.outside import data_file
from tests.support.runs import DURATION, FILES, sha, summary_of

FIX_COLUMNS = (
    "craft t_gps_s valid x_ecef_m y_ecef_m z_ecef_m vx_ecef_mps vy_ecef_mps vz_ecef_mps clock_bias_m "
    "satellites pdop"
).split()
START_GPS_S = 1712 * 604_800 + 3 * 86_400 + 900.0  # 2012-10-31 00:15:00: GPS week 1712, Wednesday


@pytest.fixture(scope="module")
def embedded(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "embedded"
    assert main(["run", "--duration", DURATION, "--out", str(folder), "--quiet"]) == 0
    return folder


def test_the_run_folder_is_complete(inline):
    assert {path.name for path in inline.iterdir()} == FILES


def test_tables_have_the_promised_columns(inline):
    fixes = pl.read_parquet(inline / "fixes.parquet")
    truth = pl.read_parquet(inline / "truth.parquet")
    assert fixes.columns[: len(FIX_COLUMNS)] == FIX_COLUMNS
    assert set(FIX_COLUMNS[3:9]) <= set(truth.columns)
    assert fixes["t_gps_s"][0] == truth["t_gps_s"][0] == START_GPS_S
    assert len(fixes) == len(truth) == int(DURATION)
    assert fixes.filter(~pl.col("valid"))["x_ecef_m"].null_count() == fixes.filter(~pl.col("valid")).height


@pytest.mark.verifies(
    "tools/results/summary.py",
    what="Summary: errors against truth, statistics",
    by="polars and NumPy over the tables",
    status="validated",
)
def test_the_summary_agrees_with_its_tables(inline):
    summary = summary_of(inline)
    fixes = pl.read_parquet(inline / "fixes.parquet").filter(pl.col("valid"))
    truth = pl.read_parquet(inline / "truth.parquet")
    both = fixes.join(truth, on="t_gps_s", suffix="_true")
    error = np.sqrt(sum((both[f"{a}_ecef_m"] - both[f"{a}_ecef_m_true"]).to_numpy() ** 2 for a in "xyz"))
    soyuz = summary["craft"]["soyuz"]
    assert soyuz["fixes"] == len(fixes) > 20
    assert soyuz["position_error_m"]["median"] == pytest.approx(np.median(error), rel=1e-6)
    assert soyuz["position_error_m"]["max"] == pytest.approx(error.max(), rel=1e-6)
    assert soyuz["satellites_tracked"]["max"] == fixes["satellites"].max()
    assert (fixes["satellites"] == fixes["satellites_used"]).all()
    lines = (inline / "bus.log").read_bytes().count(b"\n")
    assert summary["frames"] == {"sent": lines, "received": lines, "lost": 0, "rejected": {}}
    assert summary["reproducible"] and summary["epochs"] == int(DURATION)


def test_the_flight_softwares_pdop_is_the_geometrys(inline):
    fixes = pl.read_parquet(inline / "fixes.parquet").filter(pl.col("valid"))
    single = fixes.filter(pl.col("measurements") == pl.col("satellites"))
    assert len(single) > 10
    assert (
        single["pdop"] - single["pdop_distinct"]
    ).abs().max() < 0.005 + 1e-6  # one digit on the bus is 0.01


@pytest.mark.verifies(what="Frame budget")
def test_no_epoch_exceeds_the_frame_budget(inline):
    (budget,) = make("soyuz").budgets
    seconds = [line.split(b".")[0] for line in (inline / "bus.log").read_bytes().splitlines()]
    counts = np.unique(seconds, return_counts=True)[1]
    assert counts.max() <= budget.frames(events=True)
    assert summary_of(inline)["bus_load_percent"]["max"] <= budget.worst_percent


def test_processes_on_a_bus_leave_the_same_bytes(inline, embedded):
    assert sha(embedded) == sha(inline)
    assert (embedded / "truth").read_bytes() == (inline / "truth").read_bytes()
    mine, its = summary_of(inline), summary_of(embedded)
    assert its["bus"] == {"interface": "embedded", "channel": ""}
    assert {k: mine[k] for k in ("craft", "frames", "bus_load_percent")} == {
        k: its[k] for k in ("craft", "frames", "bus_load_percent")
    }
    assert its["epoch_latency_ms"]["p50"] > 0


@pytest.mark.verifies(what="What a run will be: arguments, plan, folder")
def test_a_run_folder_repeats_its_run(inline, tmp_path):
    again = tmp_path / "again"
    assert (
        main(["run", str(inline / "scenario.toml"), "--bus", "inline", "--out", str(again), "--quiet"]) == 0
    )
    assert sha(again) == sha(inline)


def test_another_seed_is_another_run(inline, tmp_path):
    other = tmp_path / "other"
    arguments = [
        "run",
        "--bus",
        "inline",
        "--duration",
        DURATION,
        "--seed",
        "2",
        "--out",
        str(other),
        "--quiet",
    ]
    assert main(arguments) == 0
    assert sha(other) != sha(inline)


def test_report_rebuilds_what_a_run_wrote(inline, tmp_path, capsys):
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("bus.log", "truth", "scenario.toml", "vehicle.toml", "run.json"):
        (copy / name).write_bytes((inline / name).read_bytes())
    assert main(["report", str(copy)]) == 0
    assert "satellites in the fix" in capsys.readouterr().out
    assert {path.name for path in copy.iterdir()} == FILES
    assert summary_of(copy) == summary_of(inline)
    for name in ("fixes", "channels", "assignments", "truth"):
        assert pl.read_parquet(copy / f"{name}.parquet").equals(pl.read_parquet(inline / f"{name}.parquet"))


def test_without_a_log_the_figures_are_the_same(inline, tmp_path):
    bare = tmp_path / "bare"
    arguments = ["run", "--bus", "inline", "--duration", DURATION, "--no-log", "--out", str(bare), "--quiet"]
    assert main(arguments) == 0
    assert {path.name for path in bare.iterdir()} == FILES - {"bus.log", "channels.parquet"}
    unlike = ("real_time_factor", "epoch_latency_ms")
    mine, its = summary_of(inline), summary_of(bare)
    assert {k: v for k, v in its.items() if k not in unlike} == {
        k: v for k, v in mine.items() if k not in unlike
    }


@pytest.mark.verifies(
    "tools/results/text.py",
    "tools/results/fault_text.py",
    "tools/results/figures.py",
    "tools/results/junit.py",
    "tools/results/verdict.py",
    what="Verdict in words and as JUnit",
    by="limits and words are ours; the XML is read by Python's parser",
    status="modelled",
)
def test_expectations_give_the_verdict(tmp_path, capsys):
    text = shipped()["soyuz"].read_text().replace("duration_s = 600", "duration_s = 60")
    text = text.replace(
        "[time]", '[expect]\n"soyuz.fixes" = {min = 1}\n"soyuz.pdop.median" = {max = 0.01}\n\n[time]'
    )
    scenario = tmp_path / "judged.toml"
    scenario.write_text(text)
    verdict, run = tmp_path / "verdict.xml", tmp_path / "run"
    arguments = [
        "run",
        str(scenario),
        "--bus",
        "inline",
        "--out",
        str(run),
        "--junit",
        str(verdict),
        "--quiet",
    ]
    assert main(arguments) == 1
    assert verdict.read_bytes().endswith(b"</testsuite>\n")
    suite = ElementTree.parse(verdict).getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("3", "1")
    assert "soyuz.pdop.median" in suite.find("testcase/failure").get("message")
    assert (suite.get("errors"), suite.get("skipped")) == ("0", "0")
    run_case, *judged = suite.findall("testcase")
    assert 0 < float(run_case.get("time")) <= float(suite.get("time"))
    assert {case.get("time") for case in judged} == {"0.000"}
    assert datetime.fromisoformat(suite.get("timestamp")).year >= 2020
    properties = {row.get("name"): row.get("value") for row in suite.iter("property")}
    assert properties["run folder"] == str(run)
    assert properties["command"].startswith("gnss-hil run ")
    said = capsys.readouterr()
    (line,) = said.err.splitlines()
    assert line.startswith("gnss-hil: expectation missed: soyuz.pdop.median: found ")
    assert line.endswith("expected at most 0.01")
    assert [row["met"] for row in summary_of(tmp_path / "run")["expectations"]] == [True, False]


@pytest.mark.parametrize(
    ("more", "status", "words"),
    [
        (["--set", "seed=x"], 2, "--set seed: input should be a valid integer"),
        (["--bus", "embedded", "--flight", "false"], 1, "flight software of soyuz ended with status 1"),
        (["--policy", "patnet"], 2, "policy 'patnet': not known"),
        (["--interval", "0.02"], 2, "the bus would overflow"),
    ],
)
def test_a_verdict_is_written_also_of_a_run_that_never_began(tmp_path, more, status, words):
    verdict = tmp_path / "verdict.xml"
    folder = tmp_path / "run"
    assert main(["run", "soyuz", *more, "--out", str(folder), "--junit", str(verdict), "--quiet"]) == status
    suite = ElementTree.parse(verdict).getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("1", "0", "1")
    assert words in suite.find("testcase/error").get("message")
    assert float(suite.get("time")) >= 0


@pytest.mark.realdata
def test_navigation_files_replace_the_sky(tmp_path):
    gps = data_file("navigation/brdc3050.12n.gz")
    run = tmp_path / "run"
    arguments = [
        "run",
        "--bus",
        "inline",
        "--duration",
        "60",
        "--nav",
        str(gps),
        "--out",
        str(run),
        "--quiet",
    ]
    assert main(arguments) == 0
    satellites = set(pl.read_parquet(run / "channels.parquet")["satellite"])
    assert satellites and all(name.startswith("G") for name in satellites)


@pytest.mark.realdata
def test_a_day_the_file_does_not_cover_is_refused_with_both_spans(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--nav", str(data_file("navigation/brdc0820.23n.gz"))]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "2023-03-" in line and "2012-10-31T00:15:00" in line
    assert not list(tmp_path.iterdir())


def test_two_craft_have_a_bus_each(tmp_path):
    text = shipped()["soyuz"].read_text()
    craft = text[text.index("[[craft]]") :]
    other = craft.replace('name = "soyuz"', 'name = "progress"').replace(
        "inclination_deg", "true_anomaly_deg = -1, inclination_deg"
    )
    scenario = tmp_path / "two.toml"
    scenario.write_text(text + other)
    runs = {bus: tmp_path / bus for bus in ("inline", "embedded")}
    for bus, folder in runs.items():
        assert (
            main(["run", str(scenario), "--bus", bus, "--duration", "45", "--out", str(folder), "--quiet"])
            == 0
        )
    assert sha(runs["inline"]) == sha(runs["embedded"])
    assert {path.name for path in runs["inline"].glob("vehicle*")} == {
        "vehicle-soyuz.toml",
        "vehicle-progress.toml",
    }
    fixes = pl.read_parquet(runs["inline"] / "fixes.parquet").filter(pl.col("valid"))
    assert set(fixes["craft"]) == set(summary_of(runs["inline"])["craft"]) == {"soyuz", "progress"}
    assert summary_of(runs["inline"])["craft"]["progress"]["position_error_m"]["median"] < 200


def test_a_craft_with_two_antennas_speaks_a_contract_of_its_own(tmp_path):
    parts = find("soyuz-ms").read_text().split("[[antenna]]")
    (tmp_path / "pair.toml").write_text("[[antenna]]".join(parts[:3]))
    arguments = ["--vehicle", str(tmp_path / "pair.toml"), "--duration", "45", "--quiet", "--out"]
    assert main(["run", *arguments, str(tmp_path / "run")]) == 0
    assert summary_of(tmp_path / "run")["craft"]["soyuz"]["satellites_tracked"]["max"] <= 12


def test_at_real_time_pace_wall_time_passes(tmp_path):
    begun = time.monotonic()
    arguments = ["run", "--pace", "x20", "--duration", "40", "--out", str(tmp_path / "run"), "--quiet"]
    assert main(arguments) == 0
    assert time.monotonic() - begun >= 39 / 20
    summary = summary_of(tmp_path / "run")
    assert not summary["reproducible"]
    assert summary["frames"]["lost"] == 0
    assert 0 < summary["real_time_factor"] < 20.5
