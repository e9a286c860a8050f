"""Somebody else's software on either side of the bus, started by the bench or by hand."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from datetime import datetime

import polars as pl
import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.lockstep.messages import session_of
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.live.progress import Progress
from gnss_hil.tools.processes import supervision
from gnss_hil.tools.processes.bus_session import BusSession
from gnss_hil.tools.processes.bus_tap import BusTap
from gnss_hil.tools.processes.children import StatusReader
from gnss_hil.tools.recording.sequence import Sequencer
from gnss_hil.tools.run_config.plan import make
from tests.support import programs
from tests.support.programs import FLIGHT, GNSS_HIL
from tests.support.runs import DURATION, sha, summary_of
from tests.support.waiting import HANG_S, ended, exit_status

OTHER = """\
import os, sys
from gnss_hil.flightsw.__main__ import main
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
    kept = (tmp_path / "run" / "flight.log").read_text()
    assert "flightsw: on embedded:" in kept
    about = json.loads((tmp_path / "run" / "run.json").read_text())["about"]
    assert about["flight"] == command


def test_a_flight_software_that_you_start_yourself_joins(inline, tmp_path):
    folder = tmp_path / "run"
    command = [
        *GNSS_HIL,
        "run",
        "--flight",
        "external",
        "--out",
        str(folder),
    ]
    bench = subprocess.Popen([*command, "--duration", DURATION], stderr=subprocess.PIPE, text=True)
    line = bench.stderr.readline()
    bus = line.split(" on ")[1].split(",")[0]
    assert line.startswith("waiting for the flight software of soyuz on embedded:")
    command = [
        *FLIGHT,
        "--once",
        "--bus",
        bus,
        "--vehicle",
        str(folder / "vehicle.toml"),
    ]
    flight = subprocess.run(command, capture_output=True, timeout=HANG_S)
    _, err = ended(bench)
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
    plan = make("soyuz")
    display = Progress(plan, quiet=True)
    line = BusSession(0, codec(4), BusTap(), Sequencer(codec(4), lockstep), None, display)
    rounds = supervision.Supervision(
        [line], display, supervision.ReportingMaster(None, StatusReader(reading)), [], lockstep
    )
    for epoch, unanswered in statuses:
        said = {"epoch": epoch, "epochs_unanswered": unanswered}
        os.write(writing, json.dumps(said).encode() + b"\n")
        rounds.round()
    assert capsys.readouterr().err == (supervision.NO_ANSWER + "\n") * notes
    os.close(reading)
    os.close(writing)


def test_on_somebody_elses_bus_the_recorder_is_a_listener(inline, tmp_path):
    with RuntimeDir() as private, Hub(private / "bus"):
        bus = f"gnss-hil:{private / 'bus'}"
        arguments = ["run", "--bus", bus, "--duration", DURATION, "--out", str(tmp_path / "run"), "--quiet"]
        assert main(arguments) == 0
    assert sha(tmp_path / "run") == sha(inline)
    assert summary_of(tmp_path / "run")["bus"] == {"interface": "gnss-hil", "channel": str(private / "bus")}


EMULATOR = """\
import os, sys
from gnss_hil.dbc.lockstep.messages import session_of
from gnss_hil.emulator.__main__ import main
here = os.environ
assert here["GNSS_HIL_CRAFT"] == "soyuz" and os.path.isabs(here["GNSS_HIL_VEHICLE"])
words = [here["GNSS_HIL_SCENARIO"], "--bus", here["GNSS_HIL_BUS"], "--pace", here["GNSS_HIL_PACE"]]
words += ["--duration", here["GNSS_HIL_DURATION"], "--session", str(session_of(1)), "--quiet"]
sys.exit(main(words + sys.argv[1:]))
"""


def run_with(emulator: str, tmp_path, *more: str) -> int:
    """`gnss-hil run` with a program of Python as the emulator; its exit status."""
    (tmp_path / "theirs.py").write_text(emulator)
    command = f"{sys.executable} {tmp_path / 'theirs.py'}"
    return main(["run", "--emulator", command, "--quiet", "--out", str(tmp_path / "run"), *more])


def test_another_emulator_is_started_with_what_it_needs(inline, tmp_path, capsys):
    assert run_with(EMULATOR, tmp_path, "--duration", DURATION) == 0
    assert sha(tmp_path / "run") == sha(inline)
    summary, ours = summary_of(tmp_path / "run"), summary_of(inline)
    assert summary["emulator"].endswith("theirs.py") and ours["emulator"] == "ours"
    assert (summary["epochs"], summary["epochs_unanswered"], summary["reproducible"]) == (70, 0, True)
    assert 0 < summary["epoch_latency_ms"]["p50"] <= summary["epoch_latency_ms"]["p99"]
    soyuz = summary["craft"]["soyuz"]
    assert soyuz["position_error_m"] == dict.fromkeys(("median", "rms", "p95", "max"))
    assert soyuz["fixes"] == ours["craft"]["soyuz"]["fixes"] > 0
    said = capsys.readouterr().out
    assert "satellites in view         -\n" in said
    assert not {"truth", "truth.parquet"} & {path.name for path in (tmp_path / "run").iterdir()}


@pytest.mark.verifies(
    "tools/processes/reference.py",
    what="Fixes of a run with another's emulator, judged by a reference orbit",
    by="our emulator as another's, its truth as CCSDS OEM: the errors of the run beside it",
    status="validated",
)
def test_fixes_of_another_emulator_are_judged_by_a_reference(inline, tmp_path, capsys):
    assert main(["export", "oem", str(inline), "--truth", "--out", str(tmp_path)]) == 0
    oem = tmp_path / "soyuz.oem"
    assert run_with(EMULATOR, tmp_path, "--duration", DURATION, "--reference", str(oem)) == 0
    mine, ours = (summary_of(folder)["craft"]["soyuz"] for folder in (tmp_path / "run", inline))
    for name, digits in (("position_error_m", 1e-3), ("velocity_error_mps", 1e-3)):
        assert mine[name] == pytest.approx(ours[name], abs=digits)
    about = json.loads((tmp_path / "run" / "run.json").read_text())["about"]
    assert about["inputs"][-1]["copy"] == "inputs/soyuz.oem"
    assert capsys.readouterr().err == ""


def test_a_reference_of_another_day_is_told_and_the_run_is_kept(inline, tmp_path, capsys):
    assert main(["export", "oem", str(inline), "--truth", "--out", str(tmp_path)]) == 0
    oem = tmp_path / "soyuz.oem"
    oem.write_text(oem.read_text().replace("2012-10-31T", "2012-11-02T"))
    assert run_with(EMULATOR, tmp_path, "--duration", "3600", "--reference", str(oem)) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "--reference" in line and "2012-11-02" in line
    summary = summary_of(tmp_path / "run")
    assert summary["craft"]["soyuz"]["position_error_m"]["max"] is None
    assert (summary["ended"], summary["failure"]) == ("failed", line.removeprefix("gnss-hil: "))
    assert 0 < summary["epochs"] < 3600, "it ends with the first mark, not at the end"


def test_a_reference_of_a_part_of_the_run_says_which(inline, tmp_path, capsys):
    assert main(["export", "oem", str(inline), "--truth", "--out", str(tmp_path)]) == 0
    oem = tmp_path / "soyuz.oem"
    lines = oem.read_text().splitlines(keepends=True)
    states = [n for n, line in enumerate(lines) if line.startswith("2012-10-31T")]
    oem.write_text("".join(line for n, line in enumerate(lines) if n not in states[40:]))
    assert run_with(EMULATOR, tmp_path, "--duration", DURATION, "--reference", str(oem)) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("30 of 70 epochs are judged by nothing")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--reference", "nowhere.oem"), "--reference: nowhere.oem: No such file or directory"),
        (("--reference", "theirs.py"), "--reference: theirs.py: "),
    ],
)
def test_what_is_no_reference_is_told_before_anything_runs(tmp_path, monkeypatch, capsys, words, line):
    monkeypatch.chdir(tmp_path)
    assert run_with(EMULATOR, tmp_path, "--duration", DURATION, *words) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert line in told
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("side", "said"),
    [
        ("flight", "no heartbeat from FLIGHT within 0.5 s"),
        ("emulator", "emulator: no time mark within 0.5 s"),
    ],
)
def test_a_side_that_is_started_elsewhere_is_awaited_as_long_as_was_asked_for(tmp_path, capsys, side, said):
    run = ["run", f"--{side}", "external", "--wait", "0.5", "--quiet", "--out", str(tmp_path / "run")]
    assert main(run) == 1
    assert said in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "run").exists()


def test_both_sides_may_be_started_by_hand_and_before_the_bench(inline, tmp_path):
    with RuntimeDir() as private:
        bus = f"embedded:{private / 'mine'}"
        flight = [
            *FLIGHT,
            "--bus",
            bus,
            "--vehicle",
            str(inline / "vehicle.toml"),
        ]
        emulator = [
            *programs.EMULATOR, str(inline / "scenario.toml"), "--bus", bus,
            "--session", str(session_of(1)),
        ]  # fmt: skip
        peers = [
            subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for command in (flight, emulator)
        ]
        for peer in peers:
            assert peer.stderr.readline().endswith(f"waiting for a bench on {bus}\n")
        arguments = ["--flight", "external", "--emulator", "external", "--bus", bus, "--duration", DURATION]
        assert main(["run", *arguments, "--out", str(tmp_path / "run"), "--quiet"]) == 0
        assert exit_status(peers[1]) == 0, peers[1].communicate()
        said = [peers[0].stderr.readline() for _ in range(2)]
        assert said[0] == f"flightsw: on {bus}, waiting for a run\n"
        assert said[1] == "flightsw: the hub closed the bus; waiting for it to come back\n"
        peers[0].send_signal(signal.SIGINT)
        assert exit_status(peers[0]) == 130
        for peer in peers:
            peer.stderr.close()
    assert sha(tmp_path / "run") == sha(inline)


LATER = """\
import os
text = open(os.environ["GNSS_HIL_SCENARIO"]).read().replace("2012-10-31T00:15:00", "2013-02-03T04:05:06")
open("later.toml", "w").write(text.replace("vehicle.toml", os.environ["GNSS_HIL_VEHICLE"]))
os.environ["GNSS_HIL_SCENARIO"] = os.path.abspath("later.toml")
"""


def test_the_record_has_the_time_that_the_emulator_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_with(LATER + EMULATOR, tmp_path, "--duration", "12") == 0
    begin = datetime(2013, 2, 3, 4, 5, 6)
    first = float((tmp_path / "run" / "bus.log").read_text().split(")")[0][1:])
    assert first == (begin - datetime(1970, 1, 1)).total_seconds() - 16  # GPS - UTC then
    t_gps_s = pl.read_parquet(tmp_path / "run" / "fixes.parquet")["t_gps_s"]
    assert t_gps_s.to_list() == [(begin - datetime(1980, 1, 6)).total_seconds() + k for k in range(12)]


PLAYER = """\
import os, sys, time
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.tools.recording.formats.candump import parse_lines
frames = parse_lines(open(sys.argv[1], "rb").read()).frames
frames = frames[[codec(4).sender_of[i] != "FLIGHT" for i in frames.can_id]]
marks = [i for i in range(len(frames)) if frames.can_id[i] == 0x10] + [len(frames)]
link = open_link(os.environ["GNSS_HIL_BUS"])
while 0x710 not in link.receive(1.0).can_id:  # let the flight software come
    pass
for begin, end in zip(marks[7:], marks[8:]):
    link.send(frames[begin:end])
    number = frames.data[begin, 1] >> 4
    while len(heard := link.receive(5.0)):  # a rhythm that the machine can keep: this epoch is answered
        if number in heard.data[heard.can_id == 0x40, 1] >> 4:
            break
time.sleep(3600)
"""


def test_an_emulator_that_neither_steers_nor_ends_is_recorded_for_the_scenarios_time(inline, tmp_path):
    (tmp_path / "player.py").write_text(PLAYER)
    player = f"{sys.executable} {tmp_path / 'player.py'} {inline / 'bus.log'}"
    folder = tmp_path / "run"
    assert main(["run", "--emulator", player, "--duration", "40", "--out", str(folder), "--quiet"]) == 0
    summary = summary_of(folder)
    assert (summary["epochs"], summary["duration_s"]) == (40, 40.0)
    # The run waits for no answer here: on a busy machine an answer may come epochs late.
    assert set(summary["frames"]["rejected"]) <= {"MIXED_EPOCH"} and summary["frames"]["lost"] == 0
    assert summary["craft"]["soyuz"]["fixes"] > 0
    assert summary["epoch_latency_ms"]["p50"] > 0


@pytest.mark.parametrize(
    ("program", "line"),
    [
        ("import sys; sys.exit(4)", "emulator of soyuz ended with status 4"),
        ("", "emulator of soyuz ended with status 0"),
    ],
)
def test_an_emulator_that_leaves_at_once_is_the_one_to_blame(tmp_path, capsys, program, line):
    assert run_with(program, tmp_path, "--duration", "12") == 1
    assert capsys.readouterr().err == f"gnss-hil: {line}\n"
    assert not (tmp_path / "run").exists()


def test_a_socket_of_your_choice_is_private_and_taken_once(tmp_path, capsys):
    with RuntimeDir() as private:
        path = private / "mine"
        with socket.socket(socket.AF_UNIX) as dead:
            dead.bind(str(path))  # what a killed bench leaves behind
        with Hub(path):
            assert path.stat().st_mode & 0o777 == 0o600
            assert main(["run", "--bus", f"embedded:{path}", "--out", str(tmp_path / "run")]) == 3
        assert capsys.readouterr().err == f"gnss-hil: bus 'embedded:{path}': another process serves it\n"
        path.write_text("something of mine")
        assert main(["run", "--bus", f"embedded:{path}", "--out", str(tmp_path / "run")]) == 3
        assert path.read_text() == "something of mine"
    assert not (tmp_path / "run").exists()
