"""Whole runs through the command line: inline and as processes, ended well, interrupted, killed."""

from __future__ import annotations

import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import polars as pl
import pytest

from dbc.codec import codec
from dbc.link.hub import Hub, PrivateFolder
from dbc.vehicle import find
from emulator.scenario import shipped
from tests.realdata import data_file
from tools.arguments import unchanged
from tools.bench import watch
from tools.bench.children import StatusReader
from tools.bench.line import Line
from tools.bench.sequence import Sequencer
from tools.bench.taps import Ear
from tools.cli import main
from tools.live.progress import Progress
from tools.plan import make

DURATION = "70"
FILES = {
    "bus.log", "truth", "scenario.toml", "vehicle.toml", "run.json", "summary.json", "fixes.parquet",
    "channels.parquet", "assignments.parquet", "truth.parquet", "epochs.parquet", "report.html",
}  # fmt: skip
FIX_COLUMNS = (
    "craft t_gps_s valid x_ecef_m y_ecef_m z_ecef_m vx_ecef_mps vy_ecef_mps vz_ecef_mps clock_bias_m "
    "satellites pdop"
).split()
START_GPS_S = 1712 * 604_800 + 3 * 86_400 + 900.0  # 2012-10-31 00:15:00: GPS week 1712, Wednesday


def sha(folder: Path) -> str:
    return hashlib.sha256((folder / "bus.log").read_bytes()).hexdigest()


def summary_of(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


@pytest.fixture(scope="module")
def inline(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "inline"
    assert main(["run", "--bus", "inline", "--duration", DURATION, "--out", str(folder), "--quiet"]) == 0
    return folder


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


def test_no_epoch_exceeds_the_frame_budget(inline):
    (budget,) = make(unchanged("soyuz")).budgets
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
    suite = ElementTree.parse(verdict).getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("3", "1")
    assert "soyuz.pdop.median" in suite.find("testcase/failure").get("message")
    said = capsys.readouterr()
    (line,) = said.err.splitlines()
    assert line.startswith("gnss-hil: expectation missed: soyuz.pdop.median: found ")
    assert line.endswith("expected at most 0.01")
    assert [row["met"] for row in summary_of(tmp_path / "run")["expectations"]] == [True, False]


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


def started(folder: Path, *more: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "tools.cli", "run", "--duration", "1d", "--out", str(folder), *more]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_frames(folder: Path, process: subprocess.Popen) -> None:
    log, deadline = folder / "bus.log", time.monotonic() + 30
    while not (log.exists() and log.stat().st_size > 300_000):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline, "no frames within 30 s"
        time.sleep(0.05)


def children_of(pid: int) -> dict[str, int]:
    """Processes started by `pid`: module name -> process number."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                words = (entry / "cmdline").read_bytes().split(b"\0")
            except (OSError, IndexError):
                continue
            if parent == pid and b"-m" in words:
                found[words[words.index(b"-m") + 1].decode()] = int(entry.name)
    return found


@pytest.mark.parametrize("bus", ["inline", "embedded"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_a_run_still_writes_its_folder(tmp_path, bus, number):
    folder = tmp_path / "run"
    process = started(folder, "--bus", bus)
    wait_for_frames(folder, process)
    children = children_of(process.pid)
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert {path.name for path in folder.iterdir()} == FILES
    summary = summary_of(folder)
    assert summary["interrupted"] and not summary["reproducible"]
    assert summary["frames"]["lost"] == 0 and summary["frames"]["rejected"] == {}
    assert "Traceback" not in err and "(interrupted)" in out
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


@pytest.mark.parametrize(
    ("module", "name"), [("flightsw", "flight software of soyuz"), ("emulator", "emulator")]
)
def test_who_died_is_told_and_the_record_is_kept(tmp_path, module, name):
    folder = tmp_path / "run"
    process = started(folder)
    wait_for_frames(folder, process)
    children = children_of(process.pid)
    os.kill(children[module], signal.SIGKILL)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 1
    assert f"gnss-hil: {name} killed by SIGKILL" in err
    assert {path.name for path in folder.iterdir()} == FILES
    assert not summary_of(folder)["reproducible"]
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


def test_when_the_supervisor_dies_the_record_holds_everything_up_to_then(tmp_path, capsys):
    folder = tmp_path / "run"
    process = started(folder)
    wait_for_frames(folder, process)
    children = children_of(process.pid)
    process.kill()
    process.communicate(timeout=30)
    deadline = time.monotonic() + 15
    while any(Path(f"/proc/{pid}").exists() for pid in children.values()):
        assert time.monotonic() < deadline, "children outlive their supervisor"
        time.sleep(0.1)
    assert main(["report", str(folder)]) == 0
    summary = summary_of(folder)
    assert summary["craft"]["soyuz"]["fixes"] > 0
    assert summary["craft"]["soyuz"]["position_error_m"]["median"] < 10
    assert summary["interrupted"] and summary["real_time_factor"] is None
    assert "satellites in the fix" in capsys.readouterr().out


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
    assert summary["real_time_factor"] == pytest.approx(20, rel=0.2)


OTHER = """\
import os, sys
from flightsw.__main__ import main
here = os.environ
assert here["GNSS_HIL_CRAFT"] == "soyuz"
assert os.path.isabs(here["GNSS_HIL_VEHICLE"])
sys.exit(main(["--bus", here["GNSS_HIL_BUS"], "--vehicle", here["GNSS_HIL_VEHICLE"], "--once"]))
"""


def test_another_flight_software_is_started_with_what_it_needs(inline, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a run folder named from here, as people do
    (tmp_path / "other.py").write_text(OTHER)
    command = f"{sys.executable} {tmp_path / 'other.py'}"
    arguments = [
        "run",
        "--flight",
        command,
        "--duration",
        DURATION,
        "--out",
        "run",
        "--quiet",
    ]
    assert main(arguments) == 0
    assert sha(tmp_path / "run") == sha(inline)
    assert summary_of(tmp_path / "run")["policy"] == command


def test_a_flight_software_that_you_start_yourself_joins(inline, tmp_path):
    folder = tmp_path / "run"
    command = [sys.executable, "-m", "tools.cli", "run", "--flight", "external", "--out", str(folder)]
    bench = subprocess.Popen([*command, "--duration", DURATION], stderr=subprocess.PIPE, text=True)
    line = bench.stderr.readline()
    bus = line.split(" on ")[1].split(",")[0]
    assert line.startswith("waiting for the flight software of soyuz on embedded:")
    command = [
        sys.executable,
        "-m",
        "flightsw",
        "--once",
        "--bus",
        bus,
        "--vehicle",
        str(folder / "vehicle.toml"),
    ]
    flight = subprocess.run(command, capture_output=True, timeout=60)
    _, err = bench.communicate(timeout=30)
    assert (bench.returncode, flight.returncode) == (0, 0), err
    assert sha(folder) == sha(inline)


def test_a_flight_software_that_cannot_start_is_told_and_leaves_nothing(tmp_path, capsys):
    assert main(["run", "--flight", "false", "--out", str(tmp_path / "run"), "--quiet"]) == 1
    assert capsys.readouterr().err == "gnss-hil: flight software of soyuz ended with status 1\n"
    assert not (tmp_path / "run").exists()


def test_a_flight_software_that_leaves_at_once_is_the_one_to_blame(tmp_path, capsys):
    assert main(["run", "--flight", "true", "--out", str(tmp_path / "run"), "--quiet"]) == 1
    assert capsys.readouterr().err == "gnss-hil: flight software of soyuz ended with status 0\n"
    assert not (tmp_path / "run").exists()


def test_the_traceback_of_another_flight_software_reaches_its_author(tmp_path, capfd):
    (tmp_path / "other.py").write_text("raise RuntimeError('the antenna fell off')\n")
    command = f"{sys.executable} {tmp_path / 'other.py'}"
    assert main(["run", "--flight", command, "--out", str(tmp_path / "run"), "--quiet"]) == 1
    lines = capfd.readouterr().err.splitlines()
    assert lines[0].startswith("Traceback")
    assert lines[-2:] == [
        "RuntimeError: the antenna fell off",
        "gnss-hil: flight software of soyuz ended with status 1",
    ]


@pytest.mark.parametrize(
    ("lockstep", "statuses", "notes"),
    [
        (True, [(0, 0), (1, 1), (2, 2)], 1),
        (True, [(1, 0), (2, 1)], 0),
        (False, [(1, 1)], 0),
    ],
)
def test_lockstep_without_any_answer_gets_one_piece_of_advice(capsys, lockstep, statuses, notes):
    reading, writing = os.pipe()
    plan = make(unchanged("soyuz"))
    display = Progress(plan, quiet=True)
    line = Line(0, codec(4), Ear(), Sequencer(codec(4), lockstep), None, display)
    rounds = watch.Watch([line], display, watch.ReportingMaster(None, StatusReader(reading)), [], lockstep)
    for epoch, unanswered in statuses:
        said = {"epoch": epoch, "epochs_unanswered": unanswered}
        os.write(writing, json.dumps(said).encode() + b"\n")
        rounds.round()
    assert capsys.readouterr().err == (watch.NO_ANSWER + "\n") * notes
    os.close(reading)
    os.close(writing)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_a_verdict_that_finds_no_room_is_one_line_after_the_run(tmp_path, capsys):
    arguments = ["run", "--bus", "inline", "--duration", "20", "--out", str(tmp_path / "run"), "--quiet"]
    assert main([*arguments, "--junit", "/dev/full"]) == 1
    assert capsys.readouterr().err == "gnss-hil: --junit /dev/full: No space left on device\n"
    assert summary_of(tmp_path / "run")["epochs"] == 20


def test_an_emulator_killed_before_its_first_epoch_is_the_one_to_blame(tmp_path):
    process = started(tmp_path / "run")
    deadline = time.monotonic() + 30
    while "emulator" not in (children := children_of(process.pid)):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)
    os.kill(children["emulator"], signal.SIGKILL)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 1
    assert err == "gnss-hil: emulator killed by SIGKILL\n"
    assert not (tmp_path / "run").exists()


def test_a_long_name_of_the_temporary_folder_is_no_hindrance(tmp_path, monkeypatch):
    deep = tmp_path / ("d" * 100)
    deep.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(deep))
    with PrivateFolder() as private, Hub(private / "can0"):
        assert private.parent == Path("/tmp")
        assert private.stat().st_mode & 0o777 == 0o700
    assert not private.exists() and not list(deep.iterdir())


def test_the_private_folder_is_where_temporary_things_belong(monkeypatch):
    with PrivateFolder() as outer:
        monkeypatch.setattr(tempfile, "tempdir", str(outer))
        with PrivateFolder() as private:
            assert private.parent == outer


def test_on_somebody_elses_bus_the_recorder_is_a_listener(inline, tmp_path):
    with PrivateFolder() as private, Hub(private / "bus"):
        bus = f"gnss-hil:{private / 'bus'}"
        arguments = ["run", "--bus", bus, "--duration", DURATION, "--out", str(tmp_path / "run"), "--quiet"]
        assert main(arguments) == 0
    assert sha(tmp_path / "run") == sha(inline)
    assert summary_of(tmp_path / "run")["bus"] == {"interface": "gnss-hil", "channel": str(private / "bus")}


def test_a_bus_that_goes_away_is_told_and_the_record_is_kept(tmp_path):
    with PrivateFolder() as private:
        hub = Hub(private / "bus")
        folder = tmp_path / "run"
        process = started(folder, "--bus", f"gnss-hil:{private / 'bus'}")
        wait_for_frames(folder, process)
        hub.close()
        _, err = process.communicate(timeout=30)
    assert process.returncode == 1
    (line,) = err.splitlines()
    assert re.match(r"gnss-hil: (bus gnss-hil:|emulator ended|flight software of soyuz ended)", line), line
    assert {path.name for path in folder.iterdir()} == FILES
