"""Same scenario, seed and software: the same bytes on every link, whatever the machine does meanwhile."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.programs import GNSS_HIL, ROOT
from tests.support.runs import children_of, recorded
from tests.support.waiting import ended, pause
from tests.system.test_socketcan import shell, uml  # noqa: F401  (a fixture)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.verifies(what="Lockstep: barrier, epochs, repetitions, both sides"),
    pytest.mark.verifies(what="Record: canonical order and stamps of frames"),
]

DURATION_S = 150
FLY = f"{shlex.quote(sys.executable)} -m gnss_hil.flightsw --quiet --once"


def command(folder: Path, *more: str) -> list[str]:
    duration = ["--duration", str(DURATION_S)]
    return [
        *GNSS_HIL,
        "run",
        "soyuz",
        "--quiet",
        *duration,
        "--out",
        str(folder),
        *more,
    ]


def played(folder: Path, *more: str) -> None:
    done = subprocess.run(command(folder, *more), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def sha_of(folder: Path) -> str:
    return hashlib.sha256((folder / "bus.log").read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def expected_log(tmp_path_factory) -> bytes:
    """The record of the inline run."""
    folder = tmp_path_factory.mktemp("inline") / "run"
    subprocess.run(command(folder, "--bus", "inline"), check=True, capture_output=True)
    log = (folder / "bus.log").read_bytes()
    assert b" 010#" in log and b" 041#" in log  # both directions: time marks and fixes
    return log


@pytest.fixture
def expected(expected_log) -> str:
    return hashlib.sha256(expected_log).hexdigest()


def test_embedded(expected, tmp_path):
    played(tmp_path / "run")
    assert sha_of(tmp_path / "run") == expected


def test_flight_software_that_starts_late(expected, tmp_path):
    late = f"sh -c 'sleep 2; exec {FLY} --vehicle $GNSS_HIL_VEHICLE --bus $GNSS_HIL_BUS'"
    played(tmp_path / "run", "--flight", late)
    assert sha_of(tmp_path / "run") == expected


def spin() -> None:
    while True:
        pass


def test_hogged_cpu(expected, tmp_path):
    """More busy processes than the machine has cores."""
    hogs = [multiprocessing.Process(target=spin, daemon=True) for _ in range(2 * os.cpu_count())]
    for hog in hogs:
        hog.start()
    try:
        played(tmp_path / "run")
    finally:
        for hog in hogs:
            hog.kill()
            hog.join()
    assert sha_of(tmp_path / "run") == expected


@pytest.mark.parametrize("module", ["emulator", "flightsw"])
def test_process_paused(expected_log, tmp_path, module):
    """A run without an end, paused near its beginning: its record begins with that of the inline run."""
    log = tmp_path / "run" / "bus.log"
    run = subprocess.Popen(
        command(tmp_path / "run", "--duration", "1d"), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    recorded(log, 50_000, run)
    pid = children_of(run.pid)[module]
    os.kill(pid, signal.SIGSTOP)
    before = log.stat().st_size
    pause(1.0)
    assert log.stat().st_size < before + 200_000  # the bench stood still
    os.kill(pid, signal.SIGCONT)
    recorded(log, len(expected_log) + 1_000_000, run)
    run.send_signal(signal.SIGINT)
    ended(run)
    assert log.read_bytes().startswith(expected_log)


@pytest.mark.slow(seconds=30)
def test_real_vcan_in_user_mode_linux(expected, tmp_path, uml):  # noqa: F811
    done = shell(*command(tmp_path / "run", "--bus", "socketcan:vcan0"), cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    print(done.stdout)
    assert sha_of(tmp_path / "run") == expected
