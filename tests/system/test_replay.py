"""Replays with real processes: each side of a recorded run against our software, and against others."""

from __future__ import annotations

import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from gnss_hil.dbc.bus.base import LinkError
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.lockstep.messages import session_of
from gnss_hil.emulator.config.scenario import shipped
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.recording.formats.candump import parse_lines
from tests.support.programs import GNSS_HIL
from tests.support.runs import children_of, recorded, summary_of
from tests.support.waiting import ended, exit_status, until

pytestmark = pytest.mark.verifies(what="Replay")

DURATION = "50"


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "run"
    words = ["run", "--bus", "inline", "--duration", DURATION, "--out", str(folder), "--quiet", "--no-report"]
    assert main(words) == 0
    return folder


@pytest.fixture
def socket():
    with RuntimeDir() as folder:
        yield f"embedded:{folder / 'can0'}"


def started(*words: str) -> subprocess.Popen:
    command = [*GNSS_HIL, *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("side", ["emulator", "flight"])
def test_a_side_of_a_run_brings_the_same_run_about(run, tmp_path, side, capsys):
    """Bit for bit: our flight software answers a recorded run emulator as it did, and the other way round."""
    out = tmp_path / "again.log"
    assert main(["replay", str(run), "--only", side, "--same", "--out", str(out)]) == 0
    assert out.read_bytes() == (run / "bus.log").read_bytes()
    other = {"emulator": "flight", "flight": "emulator"}[side]
    assert f"{other:<11} as recorded in all of {DURATION} epochs" in capsys.readouterr().out


def test_a_recording_of_another_format_does_as_well(run, tmp_path):
    trace, again = tmp_path / "trace.blf", tmp_path / "again.asc"
    assert main(["convert", str(run), str(trace)]) == 0
    words = ["--only", "emulator", "--vehicle", "soyuz-ms", "--out", str(again), "--same", "--quiet"]
    assert main(["replay", str(trace), *words]) == 0
    assert main(["convert", str(again), str(tmp_path / "again.log")]) == 0
    assert (tmp_path / "again.log").read_bytes() == (run / "bus.log").read_bytes()
    assert {p.name for p in tmp_path.iterdir()} == {"trace.blf", "again.asc", "again.log"}


@pytest.mark.parametrize("suffix", ["log", "asc", "blf", "mf4"])
def test_every_format_is_replayed(run, tmp_path, suffix, capsys):
    """Also where the first pieces of a reader are empty, as in a file whose beginning is of another bus."""
    trace = tmp_path / f"trace.{suffix}"
    assert main(["convert", str(run), str(trace)]) == 0
    words = ["--only", "emulator", "--vehicle", "soyuz-ms", "--same"]
    assert main(["replay", str(trace), *words]) == 0
    assert f"as recorded in all of {DURATION} epochs" in capsys.readouterr().out


@pytest.mark.verifies(
    "tools/replay/damage.py",
    what="What a recording lacks",
    by="records cut and altered by hand, their frames counted",
    status="validated",
)
def test_what_a_recording_lacks_is_told(run, tmp_path, capsys):
    rows = (run / "bus.log").read_text().splitlines(keepends=True)
    marks = [place for place, row in enumerate(rows) if " 010#" in row]
    measured = [place for place in range(marks[40], marks[41]) if " 06" in rows[place]]

    def told(rows: list[str]) -> str:
        log = tmp_path / "damaged.log"
        log.write_text("".join(rows))
        assert main(["replay", str(log), "--only", "emulator", "--vehicle", "soyuz-ms", "--quiet"]) == 0
        return capsys.readouterr().err

    begin = f"gnss-hil: {tmp_path / 'damaged.log'}: can0: the recording is not whole: "
    assert told(rows) == ""
    assert told([row for place, row in enumerate(rows) if place not in measured[:3]]).startswith(
        f"{begin}frames missing by their counters: 3\n"
    )
    other = rows[measured[0]]
    flipped = other[:-2] + ("0" if other[-2] != "0" else "1") + "\n"
    altered = [flipped if place == measured[0] else row for place, row in enumerate(rows)]
    assert "frames do not pass their checks: 1 CORRUPTED" in told(altered)
    assert "1 of 50 epochs is missing" in told(rows[: marks[20]] + rows[marks[21] :])


def test_what_is_left_out_of_a_recording_is_told(run, tmp_path, capsys):
    log = tmp_path / "more.log"
    whole = (run / "bus.log").read_bytes()
    log.write_bytes(whole.partition(b"\n")[0].replace(b"#", b"##1") + b"\n" + whole)
    assert main(["replay", str(log), "--only", "emulator", "--vehicle", "soyuz-ms", "--quiet"]) == 0
    assert f"gnss-hil: {log}: frames left out: 1 CAN FD\n" in capsys.readouterr().err


def test_a_difference_is_told_and_counts(run, capsys):
    words = ["replay", str(run), "--only", "emulator", "--policy", "prototype", "--quiet"]
    assert main(words) == 0
    assert "differs from the recording in " in capsys.readouterr().out
    assert main([*words, "--same"]) == 1
    said = capsys.readouterr()
    assert "\nflight      differs from the recording in " in said.out and not said.err


def test_another_navigator_with_the_policy_of_the_run(run, capsys):
    words = ["replay", str(run), "--only", "emulator", "--quiet", "--same", "--navigator"]
    assert main([*words, "all_in_view"]) == 0
    assert main([*words, "best_antenna"]) == 1
    assert "differs from the recording in " in capsys.readouterr().out


@pytest.mark.verifies(
    "tools/replay/output.py",
    what="What a replay leaves",
    by="a recording, or a run folder like that of a run",
    status="modelled",
)
def test_a_replay_can_be_reported_like_a_run(run, tmp_path, capsys):
    folder = tmp_path / "report"
    words = ["--only", "emulator", "--flight", f"{sys.executable} -m tests.support.replayed", "--quiet"]
    assert main(["replay", str(run), *words, "--report", str(folder)]) == 0
    before, after = summary_of(run), summary_of(folder)
    assert after["craft"] == before["craft"]
    assert (after["emulator"], after["pace"]) == (f"replay of {run}", "lockstep")
    assert (folder / "report.html").exists()
    assert f"report:     {folder / 'report.html'}" in capsys.readouterr().out


def test_a_running_flight_software_starts_afresh_at_each_replay(run, socket, tmp_path):
    """The same session and the epochs from the first again; and another session; and in real time."""
    flight = started("fly", "--vehicle", "soyuz-ms", "--bus", socket, "--quiet")
    try:
        for more in ([], [], ["--session", "77"]):
            words = ["replay", str(run), "--only", "emulator", "--bus", socket, "--same", "--quiet"]
            assert main([*words, *more]) == 0
        out = tmp_path / "fast.log"
        words = ["replay", str(run), "--only", "emulator", "--bus", socket, "--pace", "x10", "--quiet"]
        assert main([*words, "--out", str(out)]) == 0
    finally:
        flight.send_signal(signal.SIGINT)
        assert exit_status(flight) == 130, flight.communicate()
        flight.communicate()
    assert fixes(out) >= fixes(run / "bus.log") - 3 > 0


def fixes(log: Path) -> int:
    """NAV_X frames: fixes, whatever they say."""
    return int((parse_lines(log.read_bytes())[2].can_id == 0x041).sum())


def test_our_emulator_started_by_hand_hears_the_recorded_flight_software(run, socket, tmp_path):
    scenario, out = str(run / "scenario.toml"), tmp_path / "again.log"
    session = str(session_of(1))
    emulator = started("emulate", scenario, "--bus", socket, "--session", session, "--quiet", "--wait", "60")
    words = ["replay", str(run), "--only", "flight", "--bus", socket, "--same", "--out", str(out), "--quiet"]
    assert main(words) == 0
    assert exit_status(emulator) == 0, emulator.communicate()
    emulator.communicate()
    assert out.read_bytes() == (run / "bus.log").read_bytes()


def test_an_epoch_that_was_not_recorded_is_told(run, socket, capsys):
    scenario = str(run / "scenario.toml")
    emulator = started("emulate", scenario, "--bus", socket, "--duration", "80", "--quiet", "--wait", "60")
    assert main(["replay", str(run), "--only", "flight", "--bus", socket, "--quiet"]) == 1
    said = capsys.readouterr().err
    assert said == f"gnss-hil: epoch {DURATION} is on the bus; the recording has 0 to {int(DURATION) - 1}\n"
    assert exit_status(emulator) == 1, emulator.communicate()
    emulator.communicate()


def test_all_of_a_recording_is_heard_by_whoever_listens(run, socket):
    replay = started("replay", str(run), "--bus", socket, "--pace", "x20")
    link = _joined(socket)
    heard = 0
    try:
        while True:
            heard += len(link.receive(5.0))
            if replay.poll() is not None and not len(link.receive(0.0)):
                break
    except Exception as error:
        assert type(error).__name__ == "LinkClosed"
    finally:
        link.close()
    out, said = ended(replay)
    recorded = len((run / "bus.log").read_bytes().splitlines())
    assert replay.returncode == 0
    assert said.startswith("gnss-hil: a bus of our own at ") and said.count("\n") == 1
    assert out.startswith(f"replayed    {recorded} frames in ")
    assert recorded * 0.5 < heard <= recorded  # what was sent before we joined is gone


def _joined(spec: str):
    def link():
        with suppress(LinkError):
            return open_link(spec)

    return until(link)


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_what_was_heard_and_nobody_behind(run, tmp_path, signum):
    out = tmp_path / "part.log"
    replay = started("replay", str(run), "--only", "emulator", "--pace", "x2", "--out", str(out))
    recorded(out, 1, replay)
    flight = children_of(replay.pid)["flightsw"]
    replay.send_signal(signum)
    told, said = ended(replay)
    assert (replay.returncode, said) == (128 + signum, "")
    assert told.startswith("replayed ")
    assert (run / "bus.log").read_bytes().startswith(out.read_bytes()[:2000])
    assert not Path(f"/proc/{flight}").exists()


def test_whoever_dies_is_named_and_what_was_heard_is_kept(run, tmp_path):
    out = tmp_path / "part.log"
    replay = started("replay", str(run), "--only", "emulator", "--pace", "x2", "--out", str(out), "--quiet")
    recorded(out, 1, replay)
    subprocess.run(["kill", "-KILL", str(children_of(replay.pid)["flightsw"])], check=True)
    _, said = ended(replay)
    assert (replay.returncode, said) == (1, "gnss-hil: flight software killed by SIGKILL\n")
    assert out.stat().st_size


def test_one_craft_of_two_is_replayed(tmp_path, capsys):
    text = shipped()["soyuz"].read_text()
    craft = text[text.index("[[craft]]") :].replace('name = "soyuz"', 'name = "progress"')
    (tmp_path / "two.toml").write_text(text + craft)
    folder, out = tmp_path / "run", tmp_path / "again.log"
    words = ["--bus", "inline", "--duration", "30", "--quiet", "--no-report"]
    assert main(["run", str(tmp_path / "two.toml"), *words, "--out", str(folder)]) == 0
    capsys.readouterr()
    assert main(["replay", str(folder), "--only", "emulator", "--quiet"]) == 2
    assert "has 2 craft; choose one with --craft: soyuz, progress" in capsys.readouterr().err
    words = ["--only", "emulator", "--craft", "progress", "--same", "--out", str(out), "--quiet"]
    assert main(["replay", str(folder), *words]) == 0
    mine = [line for line in (folder / "bus.log").read_bytes().splitlines() if b" can1 " in line]
    assert out.read_bytes().splitlines() == mine


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("", "--bus embedded: nobody else can be there"),
        ("--only emulator --flight external", "--bus embedded: nobody else can be there"),
        ("--only emulator --flight no-such-program", "no such program"),
        ("--only emulator --emulator ours", "--emulator needs --only flight"),
        ("--only emulator --policy nobody", "policy 'nobody': not known"),
        ("--only emulator --bus embedded:/nowhere/b --policy patent", "belongs to our own flight software"),
        ("--only emulator --navigator nobody", "navigator 'nobody': not known"),
        ("--only flight --navigator all_in_view", "belongs to our own flight software"),
        ("--only emulator --require none", "every epoch would wait for an answer"),
        ("--only emulator --session 70000", "a whole number from 1 to 65535"),
        ("--only emulator --craft nobody", "no such craft in"),
        ("--only emulator --report .", "exists and is not an empty folder"),
        ("--only emulator --out a.csv", "suffix '.csv' is no recording"),
        ("--only flight --pace x2", "the emulator on the bus has the time"),
        ("--only flight --session 5", "--session needs --only emulator"),
        ("--bus embedded:/nowhere/b --pace lockstep", "needs --only emulator"),
        ("--bus embedded:/nowhere/b --out a.log", "--out needs --only"),
        ("--bus embedded:/nowhere/b --same", "--same needs --only"),
    ],
)
def test_mistakes_are_one_line(run, words, told, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "something").touch()
    assert main(["replay", str(run), *words.split()]) in (2, 3)
    said = capsys.readouterr().err
    assert told in said and said.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["something"]


def test_a_recording_alone_needs_to_be_told_its_vehicle_and_has_no_scenario(run, tmp_path, capsys):
    trace = tmp_path / "trace.log"
    trace.write_bytes((run / "bus.log").read_bytes())
    assert main(["replay", str(trace), "--only", "emulator"]) == 2
    assert "name its vehicle with --vehicle" in capsys.readouterr().err
    assert main(["replay", str(trace), "--only", "flight"]) == 2
    assert "an emulator needs its scenario" in capsys.readouterr().err
    assert main(["replay", str(tmp_path), "--only", "flight"]) == 2
    assert "is no run folder with a log" in capsys.readouterr().err
    assert main(["replay", str(tmp_path / "none.log"), "--only", "flight"]) == 2
    assert "no such run folder or recording" in capsys.readouterr().err
