"""Runs in processes of their own, their folders, and the children they have."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests.support.programs import GNSS_HIL
from tests.support.waiting import until

DURATION = "70"
FILES = {
    "bus.log", "truth", "scenario.toml", "vehicle.toml", "run.json", "summary.json", "fixes.parquet",
    "channels.parquet", "assignments.parquet", "truth.parquet", "epochs.parquet", "checks.parquet",
    "report.html",
}  # fmt: skip


def sha(folder: Path) -> str:
    return hashlib.sha256((folder / "bus.log").read_bytes()).hexdigest()


def summary_of(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


def started(folder: Path, *more: str, before: Sequence[str] = ()) -> subprocess.Popen:
    """before: words of the command line in front of ours."""
    command = [
        *before,
        *GNSS_HIL,
        "run",
        "--duration",
        "1d",
        "--out",
        str(folder),
        *more,
    ]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_frames(folder: Path, process: subprocess.Popen) -> None:
    recorded(folder / "bus.log", 300_000, process)


def recorded(log: Path, size: int, process: subprocess.Popen) -> None:
    """Waits until a log has so many bytes."""
    until(lambda: log.exists() and log.stat().st_size >= size, process)


def alive(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def children_of(pid: int) -> dict[str, int]:
    """Processes started by `pid`: last part of the module's name -> process number."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                words = (entry / "cmdline").read_bytes().split(b"\0")
            except (OSError, IndexError):
                continue
            if parent == pid and b"-m" in words:
                found[words[words.index(b"-m") + 1].decode().rpartition(".")[2]] = int(entry.name)
    return found
