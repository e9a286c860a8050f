"""docs/results.json: what was measured, when, of which commit, on what machine."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs" / "results.json"


@dataclass(frozen=True, slots=True)
class Kept:
    """One result as it was measured.

    commit   with a + behind it if files were changed since
    load     processes that wanted a core when it began, this one not counted
    output   what the command printed, of results that show it
    """

    date: str
    commit: str
    machine: str
    load: float
    command: str
    figures: dict[str, float]
    output: str = ""


def read(path: Path = FILE) -> dict[str, Kept]:
    """By name; empty if there is no file."""
    if not path.exists():
        return {}
    return {name: Kept(**row) for name, row in json.loads(path.read_text("utf-8")).items()}


def write(kept: dict[str, Kept], path: Path = FILE) -> None:
    """In one step: an interrupt leaves the old file or the new one."""
    text = json.dumps({name: asdict(kept[name]) for name in sorted(kept)}, indent=1)
    beside = path.with_suffix(".new")
    beside.write_text(text + "\n", "utf-8")
    beside.replace(path)


def measured(command: str, figures: dict[str, float], load: float, output: str = "") -> Kept:
    """A result of now and here."""
    rounded = {name: float(f"{value:.6g}") for name, value in figures.items()}
    return Kept(date.today().isoformat(), commit(), machine(), round(load, 1), command, rounded, output)


def commit() -> str:
    """Of the repository."""
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs", ":!*.md")
    return _git("rev-parse", "--short", "HEAD") + ("+" if changed else "")


def _git(*words: str) -> str:
    return subprocess.run(("git", "-C", str(ROOT), *words), capture_output=True, text=True).stdout.strip()


def machine() -> str:
    """What kind it is, in a line."""
    model = platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if "model name" in line
        ]
        model = lines[0] if lines else model
    return (
        f"{os.cpu_count()} cores of {model}, {platform.system()}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}"
    )
