"""`gnss_hil.run`: the same run as the command's, mistakes in one line each, a cheap import."""

from __future__ import annotations

import gc
import re
import shlex
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import gnss_hil
from gnss_hil.tools.command_line.main import main
from tests.support.outside import program
from tests.support.runs import FILES, recorded, sha, summary_of

pytestmark = pytest.mark.verifies(
    "tools/bench/run.py",
    "tools/bench/arguments.py",
    "tools/bench/errors.py",
    "tools/run_config/combination.py",
    what="Runs from a program",
    by="the command line: same bytes, same messages",
    status="modelled",
)


@pytest.fixture(scope="module")
def flown(tmp_path_factory) -> gnss_hil.Run:
    return gnss_hil.run(
        "soyuz", duration="45s", bus="inline", seed=3, out=tmp_path_factory.mktemp("runs") / "a"
    )


def test_it_is_the_run_of_the_command(flown, tmp_path, capsys):
    by_command = tmp_path / "command"
    arguments = ["run", "soyuz", "--duration", "45", "--bus", "inline", "--seed", "3", "--quiet"]
    assert main([*arguments, "--out", str(by_command)]) == 0
    assert {path.name for path in flown.folder.iterdir()} == FILES
    assert sha(flown.folder) == sha(by_command)
    apart = ("real_time_factor", "epoch_latency_ms", "mark_late_ms")
    mine, its = summary_of(flown.folder), summary_of(by_command)
    assert {k: v for k, v in mine.items() if k not in apart} == {
        k: v for k, v in its.items() if k not in apart
    }
    assert (flown.status, flown.failures, flown.notes) == ("complete", (), ())
    assert capsys.readouterr().err == ""


def test_its_command_line_repeats_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run = gnss_hil.run(
        Path("soyuz"), duration=4, interval=0.5, bus="inline", policy="patent",
        options={"ionosphere_free": False, "ura_scale": 1.5},
        on=["code_noise"], off=["all"], report=False, log=False,
        set={"craft.0.orbit.altitude_km": 512.5, "craft.0.attitude": {"mode": "lvlh"}, "description": "it's"},
        out="first",
    )  # fmt: skip
    assert run.folder == tmp_path / "first"
    program, *words = shlex.split(run.command)
    assert program == "gnss-hil"
    assert main([*words, "--out", "again", "--quiet", "--no-report"]) == 0
    one, other = ((tmp_path / name / "scenario.toml").read_text() for name in ("first", "again"))
    assert one == other
    assert "altitude_km = 512.5" in one and "it's" in one
    assert summary_of(tmp_path / "first")["craft"] == summary_of(tmp_path / "again")["craft"]
    assert not (tmp_path / "again" / "bus.log").exists()


def test_processes_give_the_same_bytes_also_from_another_thread(flown, tmp_path):
    found: list[gnss_hil.Run] = []
    thread = threading.Thread(
        target=lambda: found.append(
            gnss_hil.run("soyuz", duration=45, seed=3, report=False, out=tmp_path / "b")
        )
    )
    thread.start()
    thread.join()
    assert sha(found[0].folder) == sha(flown.folder)


def test_runs_leave_nothing_in_memory(tmp_path):
    """Of what the collector knows: a world is a few hundred objects in cycles, and megabytes of arrays."""
    counts = []
    for number in range(4):
        gnss_hil.run("soyuz", duration=3, bus="inline", out=tmp_path / str(number), report=False)
        counts.append(len(gc.get_objects()))
    assert counts[3] - counts[2] < 100


MISTAKES = [
    ({"duration": "5parsec"}, r"--duration: '5parsec' is not a duration", 2),
    ({"duration": -5}, r"--duration: -5 s; must be finite and greater than 0", 2),
    ({"seed": -1}, r"--seed: '-1': a whole number", 2),
    ({"bus": "inlin"}, r"--bus: 'inlin': not one of embedded, inline", 2),
    ({"bus": "inline", "pace": "x2"}, r"--pace x2 with --bus inline", 2),
    ({"bus": "socketcan:nosuch0"}, r"bus 'socketcan:nosuch0': ", 3),
    ({"on": "code_noise"}, r"on='code_noise': a list of them, as in on=\['code_noise'\]", 2),
    ({"on": ["code_nose"]}, r"--on: invalid choice: 'code_nose'.*did you mean 'code_noise'", 2),
    ({"set": {"craft.0.altitud": 5}}, r"--set craft\.0\.altitud: craft\.0 has no key 'altitud'", 2),
    ({"policy": "patnet"}, r"craft soyuz: policy 'patnet': not known.*did you mean 'patent'", 2),
    ({"flight": ["nosuch", "-x"]}, r"--flight 'nosuch -x': no such program", 2),
    ({"flight": "external", "bus": "inline"}, r"--flight external with --bus inline", 2),
    ({"flight": ["false"]}, r"flight software of soyuz ended with status 1", 1),
]


@pytest.mark.parametrize(("asked", "line", "status"), MISTAKES, ids=lambda x: str(x)[:30])
def test_a_mistake_is_one_line_and_leaves_nothing(asked, line, status, desk, capfd):
    with pytest.raises(gnss_hil.BenchError) as caught:
        gnss_hil.run(**{"duration": 5, "out": "run", **asked})
    assert re.match(line, str(caught.value)), str(caught.value)
    assert "\n" not in str(caught.value)
    assert (caught.value.status, caught.value.folder) == (status, None)
    assert list(desk.iterdir()) == []
    assert capfd.readouterr().err == ""


def test_a_scenario_that_there_is_not(desk):
    with pytest.raises(gnss_hil.BenchError, match=r"scenario 'soyus': not found.*did you mean 'soyuz'"):
        gnss_hil.run("soyus")
    with pytest.raises(gnss_hil.BenchError, match=r"exists and is not an empty folder"):
        (desk / "run").mkdir()
        (desk / "run" / "mine").touch()
        gnss_hil.run(out="run")
    with pytest.raises(gnss_hil.BenchError) as caught:
        gnss_hil.run(out="run")
    assert caught.value.folder is None  # it is somebody else's


def dying_flight(tmp_path: Path) -> list[str]:
    """Our flight software that dies in its thirtieth epoch."""
    script = tmp_path / "dying.py"
    script.write_text(
        "import os, sys\n"
        "from gnss_hil.flightsw.app import step\n"
        "from gnss_hil.flightsw.app.step import flight_step as fly\n"
        "epochs = 0\n"
        "def dying(*given):\n"
        "    global epochs\n"
        "    epochs += 1\n"
        "    if epochs == 30: os._exit(7)\n"
        "    return fly(*given)\n"
        "step.flight_step = dying\n"
        "sys.argv = ['fly', '--once', '--quiet', '--vehicle', os.environ['GNSS_HIL_VEHICLE'],\n"
        "            '--bus', os.environ['GNSS_HIL_BUS']]\n"
        "from gnss_hil.flightsw.__main__ import main\n"
        "sys.exit(main())\n"
    )
    return [sys.executable, str(script)]


def test_a_run_that_breaks_off_is_an_error_with_its_folder(tmp_path):
    flight, out = dying_flight(tmp_path), tmp_path / "run"
    with pytest.raises(gnss_hil.BenchError, match="flight software of soyuz ended with status 7") as caught:
        gnss_hil.run("soyuz", duration=60, flight=flight, out=out, report=False)
    assert (caught.value.status, caught.value.folder) == (1, out)
    kept = gnss_hil.Run.read(out)
    assert kept.status == "failed"
    assert kept.failures == ("flight software of soyuz ended with status 7",)
    assert len(kept.epochs) >= 29
    run = gnss_hil.run("soyuz", duration=60, flight=flight, out=tmp_path / "b", report=False, check=False)
    assert (run.status, run.failures) == ("failed", kept.failures)


def test_ctrl_c_is_a_keyboard_interrupt_behind_a_whole_record(tmp_path):
    script = tmp_path / "program.py"
    script.write_text(
        "import gnss_hil\n"
        "try:\n"
        "    gnss_hil.run('soyuz', duration='1d', bus='inline', out='run', report=False)\n"
        "except KeyboardInterrupt:\n"
        "    print('stopped', gnss_hil.Run.read('run').status)\n"
    )
    process = subprocess.Popen([sys.executable, script], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    recorded(tmp_path / "run" / "bus.log", 300_000, process)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate()
    assert said == "stopped interrupted\n"


HEAVY = ("numpy", "polars", "pydantic", "argparse", "can", "gnss_hil.tools")


def test_importing_brings_nothing_heavy():
    code = f"import sys, gnss_hil; print([m for m in {HEAVY} if m in sys.modules], dir(gnss_hil)[-1])"
    assert output(code) == "[] run\n"


def test_without_polars_the_import_goes_and_use_says_what_to_install():
    code = (
        "import sys; sys.modules['polars'] = None; import gnss_hil\n"
        "try: gnss_hil.run\nexcept ImportError as error: print(error)"
    )
    assert output(code) == "gnss_hil.run needs Polars: pip install 'gnss-hil[bench]'\n"
    with pytest.raises(AttributeError, match="module 'gnss_hil' has no attribute 'rum'"):
        gnss_hil.rum  # noqa: B018


def output(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout


def test_the_plugin_brings_itself_alone_to_other_peoples_tests():
    code = (
        "import sys, pytest; before = {*sys.modules}; import gnss_hil.tools.pytest_plugin\n"
        "print(sorted({*sys.modules} - before))"
    )
    assert output(code) == "['gnss_hil', 'gnss_hil.tools', 'gnss_hil.tools.pytest_plugin']\n"


def test_importing_costs_next_to_nothing(tmp_path):
    """In instructions, of what the interpreter's own start costs."""
    program("valgrind", "valgrind", "VALGRIND")
    assert instructions("import gnss_hil", tmp_path) < 1.06 * instructions("pass", tmp_path)


def instructions(code: str, folder: Path) -> int:
    command = [
        "valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null",
        f"--log-file={folder}/log", sys.executable, "-c", code,
    ]  # fmt: skip
    environment = {"PYTHONHASHSEED": "0", "PATH": "/usr/bin"}
    for words in (command[-3:], command):  # what is imported is compiled by then
        subprocess.run(words, check=True, capture_output=True, env=environment)
    return int(re.search(r"I\s+refs:\s+([\d,]+)", (folder / "log").read_text())[1].replace(",", ""))
