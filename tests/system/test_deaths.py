"""Runs that end before their time: interrupted, a process killed, the bus gone, the disk full."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
from pathlib import Path

import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.processes.run_session import NOT_YET
from tests.support.runs import FILES, alive, children_of, started, summary_of, wait_for_frames
from tests.support.waiting import ended, until


@pytest.mark.parametrize("bus", ["inline", "embedded"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_interrupted_a_run_still_writes_its_folder(tmp_path, bus, number):
    folder = tmp_path / "run"
    process = started(folder, "--bus", bus)
    wait_for_frames(folder, process)
    children = children_of(process.pid)
    process.send_signal(number)
    out, err = ended(process)
    assert process.returncode == 128 + number, err
    assert {path.name for path in folder.iterdir()} == FILES
    summary = summary_of(folder)
    assert summary["interrupted"] and not summary["reproducible"]
    assert summary["frames"]["lost"] == 0 and summary["frames"]["rejected"] == {}
    assert "Traceback" not in err and "(interrupted)" in out
    assert f"interrupted after {summary['epochs']} of 86 400 epochs" in out.replace("\u202f", " ")
    assert summary["ended"] == "interrupted"
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(
    "where", ["gnss_hil.tools.commands.run.add_arguments", "gnss_hil.tools.run_config.plan.make"]
)
def test_interrupted_while_it_loads_a_run_says_so_and_leaves_nothing(
    tmp_path, monkeypatch, capsys, number, where
):
    monkeypatch.setattr(where, lambda *_: signal.raise_signal(number))
    before = signal.getsignal(number)
    assert main(["run", "--out", str(tmp_path / "run")]) == 128 + number
    assert capsys.readouterr() == ("", "gnss-hil: run: interrupted\n")
    assert signal.getsignal(number) is before and not (tmp_path / "run").exists()


def test_interrupted_before_the_first_epoch_a_run_says_so(tmp_path, monkeypatch, capsys):
    def interrupted(*_):
        signal.raise_signal(signal.SIGTERM)  # the run listens by now
        return NOT_YET

    monkeypatch.setattr("gnss_hil.tools.processes.run_session._play_inline", interrupted)
    assert main(["run", "--bus", "inline", "--quiet", "--out", str(tmp_path / "run")]) == 143
    assert capsys.readouterr() == ("", "gnss-hil: run: interrupted before the run began\n")
    assert not (tmp_path / "run").exists()


def test_an_ignored_hangup_stays_ignored(monkeypatch, capsys):
    monkeypatch.setattr("gnss_hil.tools.commands.scenarios.run", lambda _: signal.raise_signal(signal.SIGHUP))
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert main(["scenarios"]) is None
    finally:
        signal.signal(signal.SIGHUP, before)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("module", "name"), [("flightsw", "flight software of soyuz"), ("emulator", "emulator")]
)
def test_who_died_is_told_and_the_record_is_kept(tmp_path, module, name):
    folder = tmp_path / "run"
    process = started(folder)
    wait_for_frames(folder, process)
    children = children_of(process.pid)
    os.kill(children[module], signal.SIGKILL)
    _, err = ended(process)
    assert process.returncode == 1
    assert f"gnss-hil: {name} killed by SIGKILL" in err
    assert {path.name for path in folder.iterdir()} == FILES
    summary = summary_of(folder)
    assert (summary["reproducible"], summary["ended"], summary["epochs_planned"]) == (False, "failed", 86_400)
    assert f"{name} killed by SIGKILL" in summary["failure"]
    assert f"not complete: failed after {summary['epochs']} of 86 400 epochs" in page_of(folder)
    assert not any(Path(f"/proc/{pid}").exists() for pid in children.values())


def test_when_the_supervisor_dies_the_record_holds_everything_up_to_then(tmp_path, capsys):
    folder = tmp_path / "run"
    process = started(folder)
    wait_for_frames(folder, process)
    children = children_of(process.pid)
    process.kill()
    ended(process)
    until(lambda: not any(map(alive, children.values())))
    assert main(["report", str(folder)]) == 0
    summary = summary_of(folder)
    assert summary["craft"]["soyuz"]["fixes"] > 0
    assert summary["craft"]["soyuz"]["position_error_m"]["median"] < 10
    assert summary["interrupted"] and summary["real_time_factor"] is None
    assert (summary["ended"], summary["epochs_planned"]) == ("failed", 86_400)
    said = capsys.readouterr().out
    assert "satellites in the fix" in said
    assert "NOT COMPLETE" in said and "it died before it could say how it ended" in said
    command = json.loads((folder / "run.json").read_text())["about"]["command"]
    assert command.startswith("gnss-hil run --duration 1d")
    assert "it died before it could say how it ended" in page_of(folder)


def page_of(folder: Path) -> str:
    return (folder / "report.html").read_text("utf-8")


def test_under_nohup_a_hangup_ends_nothing(tmp_path):
    folder = tmp_path / "run"
    process = started(folder, "--duration", "40m", before=("nohup",))
    wait_for_frames(folder, process)
    process.send_signal(signal.SIGHUP)
    _, err = ended(process)
    assert process.returncode == 0, err
    assert summary_of(folder)["epochs"] == 2400


def test_an_emulator_killed_before_its_first_epoch_is_the_one_to_blame(tmp_path):
    process = started(tmp_path / "run", "--flight", "sleep 3600")  # no first epoch without it
    emulator = until(lambda: children_of(process.pid).get("emulator"), process)
    os.kill(emulator, signal.SIGKILL)
    _, err = ended(process)
    assert process.returncode == 1
    assert err == "gnss-hil: emulator killed by SIGKILL\n"
    assert not (tmp_path / "run").exists()


def test_a_bus_that_goes_away_is_told_and_the_record_is_kept(tmp_path):
    with RuntimeDir() as private:
        hub = Hub(private / "bus")
        folder = tmp_path / "run"
        process = started(folder, "--bus", f"gnss-hil:{private / 'bus'}", "--quiet")
        wait_for_frames(folder, process)
        hub.close()
        _, err = ended(process)
    assert process.returncode == 1
    blamed = "bus gnss-hil:|emulator ended|flight software of soyuz ended"
    assert re.fullmatch(rf"gnss-hil: ({blamed}).*\n", err), err
    assert {path.name for path in folder.iterdir()} == FILES


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_a_verdict_that_finds_no_room_is_one_line_after_the_run(tmp_path, capsys):
    arguments = ["run", "--bus", "inline", "--duration", "20", "--out", str(tmp_path / "run"), "--quiet"]
    assert main([*arguments, "--junit", "/dev/full"]) == 1
    assert capsys.readouterr().err == "gnss-hil: --junit /dev/full: No space left on device\n"
    assert summary_of(tmp_path / "run")["epochs"] == 20


def test_a_disk_that_is_full_for_run_json_too_hides_not_what_was_full(tmp_path, monkeypatch, capsys):
    written = []

    def full(plan, config, folder, recorder, *_):
        recorder.frames = 1
        raise OSError(errno.ENOSPC, "No space left on device", "bus.log")

    def write_json(path, document):
        if written:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        written.append(path)

    monkeypatch.setattr("gnss_hil.tools.processes.run_session._play_inline", full)
    monkeypatch.setattr("gnss_hil.tools.processes.run_session.write_json", write_json)
    assert main(["run", "--bus", "inline", "--quiet", "--out", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err.endswith("gnss-hil: bus.log: No space left on device\n") and written
