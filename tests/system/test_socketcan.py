"""Real SocketCAN for machines without it: user-mode Linux, and in it the suites that need a kernel with CAN.

Where user-mode Linux is not installed this skips, loudly; with GNSS_HIL_REQUIRE_SOCKETCAN set it fails.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest

from gnss_hil.tools.processes.vcan import interfaces, machine
from gnss_hil.tools.processes.vcan import shell as vcan_shell
from tests.support.outside import missing
from tests.support.programs import GNSS_HIL, ROOT
from tests.support.waiting import HANG_S, exit_status, until

pytestmark = pytest.mark.verifies(
    "dbc/bus/socketcan.py",
    "dbc/bus/mmsg.py",
    "dbc/bus/pythoncan.py",
    "tools/processes/vcan/interfaces.py",
    "tools/processes/vcan/shell.py",
    "tools/processes/vcan/kernel.py",
    "tools/processes/vcan/guest_scripts.py",
    "tools/processes/vcan/guard.py",
    "tools/gateway/cangw.py",
    what="SocketCAN, and a kernel that has it",
    by="Linux vcan in user-mode Linux; candump, cansend, cangw, python-can",
    status="validated",
)

IMPORTS = "import signal, sys; from gnss_hil.tools.processes.vcan.shell import shell"


@pytest.fixture
def uml():
    """User-mode Linux, or no test."""
    fault = machine.lacking()
    if fault:
        missing("SOCKETCAN", f"REAL SOCKETCAN WAS NOT TESTED: user-mode Linux {fault}")


def shell(*command: str, timeout_s: float = HANG_S, **more) -> subprocess.CompletedProcess:
    """`shell` in a process of its own, as the command line runs it."""
    program = f"{IMPORTS}; sys.exit(shell(sys.argv[1:], {timeout_s}))"
    return subprocess.run(
        [sys.executable, "-c", program, *command],
        capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=timeout_s + HANG_S, **more,
    )  # fmt: skip


def kernels() -> list[int]:
    """Processes of the kernels of this test, which has a temporary folder of its own."""
    here = re.escape(tempfile.gettempdir())
    found = subprocess.run(["pgrep", "-f", f"{here}/gnss-hil-vcan-.*/init"], capture_output=True)
    return [int(number) for number in found.stdout.split()]


def nothing_left() -> bool:
    """Whether no folder and no kernel of this test is there."""
    return not kernels() and not list(Path(tempfile.gettempdir()).glob("gnss-hil-vcan-*"))


@pytest.mark.slow(seconds=150)
def test_the_suites_for_a_kernel_with_can_pass_in_user_mode_linux(uml):
    suites = ["tests/conformance", "tests/system/test_socketcan_inside.py"]
    suites += ["tests/system/test_receiver_py_inside.py", "tests/system/test_replay_inside.py"]
    suites += ["tests/system/test_cangw_inside.py"]
    done = shell(
        sys.executable, "-m", "pytest", "-q", "-rA", "-m", "socketcan", "-p", "no:cacheprovider", *suites,
        timeout_s=10 * HANG_S, cwd=ROOT,
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
        "the_kernel_does_to_every_frame",
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
    done = shell("sh", "-c", "sleep 1000 & seq 1 100000")
    assert done.returncode == 0
    assert done.stdout == "".join(f"{k}\n" for k in range(1, 100_001))
    until(nothing_left)


def test_a_command_that_takes_too_long_is_stopped(uml):
    done = shell("sleep", "1000", timeout_s=5)
    assert done.returncode == vcan_shell.TIMED_OUT
    assert done.stderr == "gnss-hil vcan shell: stopped after 5 s\n"
    until(nothing_left)


def test_an_interrupt_ends_it(uml):
    # What runs in the background of a shell ignores interrupts, and so would its children.
    program = (
        f"{IMPORTS}; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "sys.exit(shell(['sh', '-c', 'echo here; sleep 1000']))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL
    )
    assert process.stdout.readline() == b"here\n"
    process.send_signal(2)
    assert exit_status(process) == 130
    process.stdout.close()
    until(nothing_left)


ON_A_TERMINAL = "import os, pty, sys; sys.exit(os.waitstatus_to_exitcode(pty.spawn(sys.argv[1:])))"


def test_on_a_terminal_it_boots_every_time(uml):
    """The kernel, which tries out ptrace as it begins, is not reached by signals about the terminal."""
    command = [*GNSS_HIL, "vcan", "shell", "--mem", "128M", "--", "sh", "-c", "tty; exit 5"]
    for _ in range(6):
        done = subprocess.run(
            [sys.executable, "-c", ON_A_TERMINAL, *command], capture_output=True, stdin=subprocess.DEVNULL
        )
        assert (done.stdout, done.returncode) == (b"/dev/tty0\r\n", 5)


@pytest.fixture
def sleeper(uml):
    """`gnss-hil vcan shell` whose command is at work."""
    process = subprocess.Popen(
        [*GNSS_HIL, "vcan", "shell", "--mem", "128M", "--", "sh", "-c", "echo here; sleep 1000"],
        stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, process_group=0,
    )  # fmt: skip
    assert process.stdout.readline() == b"here\n"
    yield process
    process.stdout.close()
    for number in kernels():  # what a failed test left
        with suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_ends_the_kernel_too(sleeper, number, status):
    sleeper.send_signal(number)
    assert exit_status(sleeper) == status
    until(nothing_left)


def test_a_kernel_ends_with_who_started_it(sleeper):
    sleeper.kill()
    assert exit_status(sleeper) == -signal.SIGKILL
    until(nothing_left)
    assert not sleeper.stdout.read()  # nobody holds the pipe any more


def test_a_signal_to_the_whole_group_leaves_nothing(sleeper):
    """As a supervisor of jobs ends them: the guard is not among those."""
    os.killpg(sleeper.pid, signal.SIGKILL)
    exit_status(sleeper)
    until(nothing_left)


def test_memory_is_what_was_asked_for(uml):
    done = subprocess.run(
        [*GNSS_HIL, "vcan", "shell", "--mem", "128M", "--", "grep", "MemTotal", "/proc/meminfo"],
        capture_output=True, text=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0
    assert 64 << 10 < int(done.stdout.split()[1]) <= 128 << 10  # kB; the kernel takes some for itself


def test_missing_packages_are_named(monkeypatch, capsys):
    monkeypatch.setattr(machine, "which", lambda program: None)
    assert vcan_shell.shell(["true"]) == machine.MISSING
    said = capsys.readouterr().err
    assert said.startswith(
        "gnss-hil vcan shell: needs the Debian packages coreutils iproute2 kmod user-mode-linux"
    )
    assert said.count("\n") == 1


def test_a_kernel_without_can_is_told_in_one_line(monkeypatch, capsys):
    monkeypatch.setattr(interfaces, "_may_change_interfaces", lambda: True)
    monkeypatch.setattr(interfaces, "_is_up", lambda interface: False)
    monkeypatch.setattr(interfaces, "_run", lambda *command: f"{command[0]}: Operation not supported")
    assert interfaces.up(["vcan0"]) == machine.MISSING
    said = capsys.readouterr().err
    assert said.startswith(
        "gnss-hil vcan up: vcan0: this kernel gives no virtual CAN (ip: Operation not supported)"
    )
    assert "vcan shell" in said and said.count("\n") == 1
