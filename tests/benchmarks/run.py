"""Whole runs at 1 Hz, 24 channels, recorder included: `python -m tests.benchmarks.run [SECONDS]`."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path

from gnss_hil.tools.command_line.main import main

GOALS = {
    "inline": (250, ("--bus", "inline")),
    "embedded": (100, ("--bus", "embedded")),
    "inline, every factor on": (100, ("--bus", "inline", "--on", "all")),
}
"""What is run -> times real time wanted, and how."""


def summary_of(duration: str, *more: str) -> dict:
    """The summary of a run in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        out = Path(folder) / "run"
        status = main(["run", "--duration", duration, "--out", str(out), "--quiet", *more])
        assert status == 0, status
        return json.loads((out / "summary.json").read_text())


def report(duration: str) -> None:
    for name, (goal, how) in GOALS.items():
        summary = summary_of(duration, *how)
        latency, frames = summary["epoch_latency_ms"], summary["frames"]
        print(
            f"{name:<23} {summary['real_time_factor']:6.0f} times real time (goal {goal}), epoch latency "
            f"{latency['p50']:.2f} ms p50, {latency['p99']:.2f} ms p99, {frames['received']} frames, "
            f"{frames['lost']} lost"
        )


if __name__ == "__main__":
    report(sys.argv[1] if len(sys.argv) > 1 else "600")
