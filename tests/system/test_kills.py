"""Fifty processes killed at random: the rest ends, says who, and the folder tells everything up to then.

A child killed: the run writes its folder as ever. The supervisor killed: no process is left that could, so
its children end, the log holds what was heard, `gnss-hil report` rebuilds the rest, and the next run removes
its private folder.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.recording.formats.candump import parse_lines
from tests.support.programs import GNSS_HIL
from tests.support.runs import FILES, alive, children_of, recorded
from tests.support.waiting import exit_status, until

pytestmark = pytest.mark.verifies(
    "tools/processes/supervisor.py",
    "tools/processes/children.py",
    "tools/processes/parent_death.py",
    "tools/run_config/sides.py",
    "tools/processes/supervision.py",
    "tools/processes/outcome.py",
    what="Processes of a run and their ends",
    by="rules of ours; they hold through fifty random kills of emulator, flight software and supervisor",
    status="modelled",
)

KILLS, SEED, AT_ONCE = 50, 3, 2
NAMES = {"emulator": "emulator", "flightsw": "flight software of soyuz"}
VICTIMS = ("emulator", "flightsw", "supervisor")
CODEC = codec(4)
ROWS = {"channels.parquet": "SV_CLOCK", "assignments.parquet": "COMMAND"}
"""Tables, and the kind of frame that makes a row of them."""


@dataclass(frozen=True, slots=True)
class Kill:
    """Who dies when so many bytes are on record, and at which pace the run goes.

    Two minutes of a run at most: in them receivers find satellites, fixes and commands begin.
    """

    number: int
    victim: str
    size: int
    pace: str


def kills(count: int) -> list[Kill]:
    draw = random.Random(SEED)
    return [
        Kill(i, VICTIMS[i % 3], draw.randrange(1, 350_000), draw.choice(("lockstep", "lockstep", "x50")))
        for i in range(count)
    ]


def killed_run(kill: Kill, folder: Path, bus: str = "embedded") -> str:
    """One run with one death; what is wrong with how it ended, "" if nothing is."""
    words = ["--duration", "1d", "--bus", bus, "--pace", kill.pace, "--no-report", "--quiet"]
    command = [*GNSS_HIL, "run", *words, "--out", str(folder)]
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    log = folder / "bus.log"
    try:
        recorded(log, kill.size, run)
        children = children_of(run.pid)
        os.kill({**children, "supervisor": run.pid}[kill.victim], signal.SIGKILL)
        until(lambda: not any(map(alive, children.values())))
        exit_status(run)
        return _ended_badly(kill, run.returncode, run.stderr.read()) or _incomplete(kill, folder)
    finally:
        run.kill()
        run.wait()
        run.stderr.close()


def _ended_badly(kill: Kill, status: int, said: str) -> str:
    if kill.victim == "supervisor":
        good = status == -signal.SIGKILL and said == ""
    else:
        good = status == 1 and said.endswith(f"gnss-hil: {NAMES[kill.victim]} killed by SIGKILL\n")
    return "" if good and "Traceback" not in said else f"status {status}: {said}"


def _incomplete(kill: Kill, folder: Path) -> str:
    """What the folder lacks; of a dead supervisor's after a report."""
    if kill.victim == "supervisor":
        command = [*GNSS_HIL, "report", str(folder)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode or not done.stderr.endswith(": it died before it could say how it ended\n"):
            return f"report ended with {done.returncode}: {done.stderr}"
    frames = json.loads((folder / "summary.json").read_text())["frames"]
    heard = parse_lines(whole_lines(folder / "bus.log"))[2]
    missing = expected(heard) - {path.name for path in folder.iterdir()}
    if kill.pace != "lockstep":
        missing -= {"assignments.parquet"}  # of commands that came too late there is no row
    rejected = frames["rejected"] if kill.pace == "lockstep" else {}  # elsewhere an answer may come too late
    if missing or frames["received"] != len(heard) or rejected or not len(heard):
        return f"missing {sorted(missing)}; {frames}, {len(heard)} lines"
    return ""


def expected(heard: FrameBatch) -> set[str]:
    """What a folder must hold; a table without a row is left out."""
    kinds = set(CODEC.kind_of[heard.can_id].tolist())
    empty = {table for table, kind in ROWS.items() if CODEC.kinds[kind].number not in kinds}
    return FILES - {"report.html"} - empty


def whole_lines(log: Path) -> bytes:
    return log.read_bytes().rpartition(b"\n")[0] + b"\n"


@pytest.mark.slow(seconds=120)
def test_one_is_killed_the_rest_ends_and_the_record_is_kept(tmp_path):
    with ThreadPoolExecutor(AT_ONCE) as pool:
        faults = list(pool.map(lambda kill: killed_run(kill, tmp_path / f"{kill.number}"), kills(KILLS)))
    told = [f"{kill}: {fault}" for kill, fault in zip(kills(KILLS), faults, strict=True) if fault]
    assert not told, "\n".join(told)
    last = [*GNSS_HIL, "run", "--duration", "5", "--out", str(tmp_path / "last")]
    subprocess.run(last, check=True, capture_output=True)
    # Each test has a temporary folder of its own: all sockets of these runs were in it.
    assert not list(Path(tempfile.gettempdir()).iterdir()), "sockets of the dead are left"
