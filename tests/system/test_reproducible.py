"""Same scenario, seed and software: the same bytes on every link, whatever the machine does meanwhile."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.runs import children_of
from tests.system.test_socketcan import shell, uml  # noqa: F401  (a fixture)

pytestmark = pytest.mark.slow

DURATION_S = 600
FLY = f"{shlex.quote(sys.executable)} -m gnss_hil.flightsw --quiet --once"


def command(folder: Path, *more: str) -> list[str]:
    duration = ["--duration", str(DURATION_S)]
    return [
        sys.executable,
        "-m",
        "gnss_hil.tools.command_line.main",
        "run",
        "soyuz",
        "--quiet",
        *duration,
        "--out",
        str(folder),
        *more,
    ]


def sha_of(folder: Path) -> str:
    return hashlib.sha256((folder / "bus.log").read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def expected(tmp_path_factory) -> str:
    """The bytes of the inline run."""
    folder = tmp_path_factory.mktemp("inline") / "run"
    subprocess.run(command(folder, "--bus", "inline"), check=True, capture_output=True)
    log = (folder / "bus.log").read_text()
    assert " 010#" in log and " 041#" in log  # both directions: time marks and fixes
    return sha_of(folder)


def test_embedded(expected, tmp_path):
    subprocess.run(command(tmp_path / "run"), check=True, capture_output=True)
    assert sha_of(tmp_path / "run") == expected


def test_flight_software_that_starts_3_s_late(expected, tmp_path):
    late = f"sh -c 'sleep 3; exec {FLY} --vehicle $GNSS_HIL_VEHICLE --bus $GNSS_HIL_BUS'"
    begun_s = time.monotonic()
    subprocess.run(command(tmp_path / "run", "--flight", late), check=True, capture_output=True)
    assert time.monotonic() - begun_s > 3
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
        subprocess.run(command(tmp_path / "run"), check=True, capture_output=True)
    finally:
        for hog in hogs:
            hog.kill()
            hog.join()
    assert sha_of(tmp_path / "run") == expected


@pytest.mark.parametrize("module", ["emulator", "flightsw"])
def test_process_paused_for_1_s(expected, tmp_path, module):
    run = subprocess.Popen(command(tmp_path / "run"), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    log, deadline = tmp_path / "run" / "bus.log", time.monotonic() + 30
    while not (log.exists() and log.stat().st_size > 50_000):
        assert time.monotonic() < deadline and run.poll() is None
        time.sleep(0.01)
    pid = children_of(run.pid)[module]
    os.kill(pid, signal.SIGSTOP)
    before = log.stat().st_size
    time.sleep(1)
    assert log.stat().st_size < before + 200_000  # the bench stood still
    os.kill(pid, signal.SIGCONT)
    assert run.wait(60) == 0
    assert sha_of(tmp_path / "run") == expected


def test_real_vcan_in_user_mode_linux(expected, tmp_path, uml):  # noqa: F811
    done = shell(
        *command(tmp_path / "run", "--bus", "socketcan:vcan0"), timeout_s=200, cwd=Path(__file__).parents[2]
    )
    assert done.returncode == 0, done.stdout + done.stderr
    print(done.stdout)
    assert sha_of(tmp_path / "run") == expected
