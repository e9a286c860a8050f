"""CPU time that an epoch of a run costs, recorder included: `python -m tests.benchmarks.cpu`.

Of processor time, not of time that passes; two lengths of a run, so that start and end cancel. The least of
ROUNDS, since a shared cache only ever costs time.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

from tests.support.programs import GNSS_HIL

SHORT, LONG, ROUNDS = 100, 1100, 3
RUNS = {"soyuz, inline": (), "soyuz, inline, every factor on": ("--on", "all")}
GOALS_MS = {"soyuz, inline": 1.3, "soyuz, inline, every factor on": 2.0}


def spent_s(epochs: int, more: tuple[str, ...]) -> float:
    """User and system time of one run with its log."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "run")
        command = [*GNSS_HIL, "run", "soyuz", "--bus", "inline", "--duration", str(epochs), "--out", out]
        before = os.times()
        subprocess.run([*command, "--quiet", "--no-report", *more], check=True, stdout=subprocess.DEVNULL)
        after = os.times()
    user_s = after.children_user - before.children_user
    return user_s + after.children_system - before.children_system


def epoch_ms(more: tuple[str, ...]) -> float:
    """CPU milliseconds an epoch."""
    rounds = [(spent_s(LONG, more) - spent_s(SHORT, more)) / (LONG - SHORT) for _ in range(ROUNDS)]
    return 1e3 * min(rounds)


if __name__ == "__main__":
    for name, more in RUNS.items():
        print(f"{name:32} {epoch_ms(more):.2f} ms CPU an epoch (goal {GOALS_MS[name]})")
