"""Real SocketCAN for machines without it: user-mode Linux, and in it the suites that need a kernel with CAN.

Where user-mode Linux is not installed this skips, loudly; with GNSS_HIL_REQUIRE_SOCKETCAN set it fails.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gnss_hil.tools.processes import vcan

ROOT = Path(__file__).parents[2]


@pytest.fixture
def uml():
    """User-mode Linux, or no test."""
    fault = vcan._lacking()
    if fault and os.environ.get("GNSS_HIL_REQUIRE_SOCKETCAN"):
        pytest.fail(f"SocketCAN was to be tested and cannot be: user-mode Linux {fault}")
    if fault:
        pytest.skip(f"REAL SOCKETCAN WAS NOT TESTED: user-mode Linux {fault}")


def shell(*command: str, timeout_s: float = 60, **more) -> subprocess.CompletedProcess:
    """`vcan.shell` in a process of its own, as the command line runs it."""
    program = f"import sys; from tools import vcan; sys.exit(vcan.shell(sys.argv[1:], {timeout_s}))"
    return subprocess.run(
        [sys.executable, "-c", program, *command],
        capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=timeout_s + 60, **more,
    )  # fmt: skip


def left_over() -> set[str]:
    return {p.name for p in Path(os.environ.get("TMPDIR", "/tmp")).glob("gnss-hil-vcan-*")}


def kernels() -> set[str]:
    done = subprocess.run(["pgrep", "-f", "gnss-hil-vcan-.*/init"], capture_output=True, text=True)
    return set(done.stdout.split())


@pytest.mark.slow
def test_the_suites_for_a_kernel_with_can_pass_in_user_mode_linux(uml):
    suites = ["tests/conformance", "tests/system/test_socketcan_inside.py"]
    suites += ["tests/system/test_receiver_py_inside.py", "tests/system/test_replay_inside.py"]
    done = shell(
        sys.executable, "-m", "pytest", "-q", "-rA", "-m", "socketcan", "-p", "no:cacheprovider", *suites,
        timeout_s=600, cwd=ROOT,
    )  # fmt: skip
    print(done.stdout, done.stderr)
    assert done.returncode == 0
    assert "skipped" not in done.stdout
    for must in (
        "[socketcan]",
        "[socketcan_by_pythoncan]",
        "candump_hears",
        "two_processes_fly",
        "in_c_flies",
        "in_c_outlives",
        "python_receiver_flies",
        "monitor_reads_vcan",
        "canplayer_plays",
        "play_it_in_lockstep",
    ):
        assert must in done.stdout


def test_a_command_finds_its_folder_environment_and_interfaces(uml, tmp_path):
    done = shell(
        "sh", "-c", 'pwd; echo "$WORD"; ls /sys/class/net; echo complaint >&2; cat; exit 7',
        cwd=tmp_path, env={**os.environ, "WORD": "it's \"here\"\nand there"},
    )  # fmt: skip
    assert done.returncode == 7
    lines = done.stdout.splitlines()
    assert lines[:3] == [str(tmp_path), 'it\'s "here"', "and there"]
    assert {"vcan0", "vcan1", "lo"} <= set(lines[3:])
    assert done.stderr == "complaint\n"


def test_output_is_whole_and_nothing_is_left_behind(uml):
    before = left_over(), kernels()
    done = shell("sh", "-c", "sleep 1000 & seq 1 100000")
    assert done.returncode == 0
    assert done.stdout == "".join(f"{k}\n" for k in range(1, 100_001))
    assert (left_over(), kernels()) == before


def test_a_command_that_takes_too_long_is_stopped(uml):
    before = left_over(), kernels()
    done = shell("sleep", "1000", timeout_s=5)
    assert done.returncode == vcan.TIMED_OUT
    assert done.stderr == "gnss-hil vcan shell: stopped after 5 s\n"
    time.sleep(0.2)
    assert (left_over(), kernels()) == before


def test_an_interrupt_ends_it(uml):
    before = left_over(), kernels()
    # What runs in the background of a shell ignores interrupts, and so would its children.
    program = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from tools import vcan; sys.exit(vcan.shell(['sh', '-c', 'echo here; sleep 1000']))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL
    )
    assert process.stdout.readline() == b"here\n"
    process.send_signal(2)
    assert process.wait(10) == vcan.INTERRUPTED
    process.stdout.close()
    time.sleep(0.2)
    assert (left_over(), kernels()) == before


def test_missing_packages_are_named(monkeypatch, capsys):
    monkeypatch.setattr(vcan, "_which", lambda program: None)
    assert vcan.shell(["true"]) == vcan.MISSING
    said = capsys.readouterr().err
    assert said.startswith(
        "gnss-hil vcan shell: needs the Debian packages coreutils iproute2 kmod user-mode-linux"
    )
    assert said.count("\n") == 1


def test_a_kernel_without_can_is_told_in_one_line(monkeypatch, capsys):
    monkeypatch.setattr(vcan, "_run", lambda *command: f"{command[0]}: Operation not supported")
    assert vcan.up(["vcan0"]) == vcan.MISSING
    said = capsys.readouterr().err
    assert said.startswith(
        "gnss-hil vcan up: vcan0: this kernel gives no virtual CAN (ip: Operation not supported)"
    )
    assert "vcan shell" in said and said.count("\n") == 1
