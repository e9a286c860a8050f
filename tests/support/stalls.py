"""Processes of a whole run stopped for some seconds at a pace: late is told as late, and nothing is taken for
another epoch's.

    python -m tests.support.stalls [--flight fsw] [--seconds 0.5 2 5] [--paces ten-hertz x300]

stops each process of a run in turn and prints a row each. A fix is on record with the instant of its own
epoch: a run passes if no error against truth is larger than `FARTHEST_M` (an epoch away is 760 m at 10 Hz,
7.6 km at 1 Hz), and if fixes that were flown and are not on record make its exit status 1. In lockstep the
log's SHA-256, the last column, is that of an undisturbed run.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from gnss_hil.emulator.config import scenario as scenarios
from tests.support.programs import GNSS_HIL
from tests.support.waiting import exit_status, pause, until

FARTHEST_M = 200.0
PACES = {
    "ten-hertz": ("realtime", 0.1, 55, 420),
    "x300": ("x300", 1.0, 1200, 60),
    "lockstep": ("lockstep", 1.0, 3000, 60),
}
"""Pace, interval between epochs [s], simulated duration [s], epoch from which on a process is stopped."""
WHO = ("supervisor", "emulator", "flight")


@dataclass(frozen=True, slots=True)
class Result:
    """How a run with a stall ended: status, fixes on record and flown, late answers, largest error [m]."""

    status: int
    recorded: int
    flown: int | None
    late: int
    error_m: float
    sha: str
    words: str

    @property
    def honest(self) -> bool:
        return self.error_m < FARTHEST_M and (self.status != 0 or self.recorded == self.flown)


def run(who: str, seconds: float, pace: str, flight: Path | None = None) -> Result:
    """A run of its own processes, of which one is stopped for some seconds when it has fixes."""
    name, interval_s, duration_s, at = PACES[pace]
    with tempfile.TemporaryDirectory(prefix="stalls-") as place:
        folder = Path(place)
        scenario = folder / "soyuz.toml"
        text = scenarios.find("soyuz").read_text("utf-8")
        scenario.write_text(text.replace("epoch_interval_s = 1.0", f"epoch_interval_s = {interval_s}"))
        command = [
            *GNSS_HIL, "run", str(scenario), "--duration", str(duration_s), "--pace", name,
            "--out", str(folder / "run"), "--no-report", "--quiet",
            *([] if flight is None else ["--flight", f"{flight} --tell"]),
        ]  # fmt: skip
        with (folder / "err").open("w") as words:
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=words)
        log = folder / "run" / "bus.log"
        until(lambda: log.exists() and log.read_bytes().count(b" 010#") >= at, process)
        victim = {"supervisor": process.pid, **children(process.pid)}[who]
        os.kill(victim, signal.SIGSTOP)
        pause(seconds)
        os.kill(victim, signal.SIGCONT)
        status = exit_status(process)
        return _result(folder, status)


def children(pid: int) -> dict[str, int]:
    """Processes of emulator and flight software of a run."""
    table = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True, check=True).stdout
    mine = [line.split(None, 2) for line in table.splitlines()[1:]]
    found = {}
    for child, parent, words in mine:
        if int(parent) == pid:
            found["emulator" if "gnss_hil.emulator" in words else "flight"] = int(child)
    return found


def _result(folder: Path, status: int) -> Result:
    words = (folder / "err").read_text()
    summary = json.loads((folder / "run" / "summary.json").read_text())
    facts = json.loads((folder / "run" / "run.json").read_text())
    (craft,) = summary["craft"].values()
    told = re.search(r"^fsw: \d+ epochs, (\d+) fixes", words, re.M)
    flown = int(told[1]) if told else next(iter(facts["fixes_flown"].values()))
    sha = hashlib.sha256((folder / "run" / "bus.log").read_bytes()).hexdigest()
    error_m = craft["position_error_m"]["max"] or 0.0
    return Result(status, craft["fixes"], flown, summary["answers_late"], error_m, sha, words)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.support.stalls", description="all stalls")
    parser.add_argument("--flight", type=Path, help="program of examples/fsw_c; it is flown too")
    parser.add_argument("--seconds", nargs="+", type=float, default=[0.5, 2.0, 5.0])
    parser.add_argument("--paces", nargs="+", choices=PACES, default=["ten-hertz", "x300"])
    options = parser.parse_args(argv)
    flights = [None, *([options.flight] if options.flight else [])]
    dishonest = 0
    for pace, who, seconds, flight in product(options.paces, WHO, options.seconds, flights):
        r = run(who, seconds, pace, flight)
        dishonest += not r.honest
        verdict = "ok" if r.honest else "DISHONEST"
        name = "ours" if flight is None else flight.name
        fixes = f"{r.recorded} fixes on record, {r.flown} flown, {r.late} answers late"
        print(f"{pace:9} {who:10} {seconds:3g} s {name:5} status {r.status}, {fixes}, ", end="")
        print(f"error at most {r.error_m:.1f} m, {r.sha[:12]}: {verdict}", flush=True)
    print(f"{dishonest} runs whose record is not the flight, or has fixes of other epochs")
    return 1 if dishonest else 0


if __name__ == "__main__":
    sys.exit(main())
