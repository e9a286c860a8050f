"""The processes of a run: how they are started, watched and ended."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gnss_hil.dbc.process.command_line import Value
from gnss_hil.tools.common.errors import Failed, Missing, Mistake
from gnss_hil.tools.processes import parent_death
from gnss_hil.tools.processes.tee import Tee
from gnss_hil.tools.recording.run_folder import FAULTS, SCENARIO, TRUTH, RunFolder
from gnss_hil.tools.run_config.config import EXTERNAL, RunConfig
from gnss_hil.tools.run_config.plan import Plan

LEAVE_S = 5.0
"""How long a process has to leave when asked, before it is killed."""

BARRIER_S = 60.0
"""How long the emulator waits for the flight software's first heartbeat."""

_CLASS_OF_STATUS = {2: Mistake, 3: Missing}


@dataclass(slots=True, eq=False)
class Child:
    """A process of the bench, and the file that catches its last words if any; `sent_away`: we ended it;
    `tee` keeps what another's program says; `status`: what it reports."""

    name: str
    process: subprocess.Popen
    words: Path | None
    sent_away: bool = False
    tee: Tee | None = None
    status: StatusReader | None = None

    @property
    def running(self) -> bool:
        return self.process.poll() is None

    def how_it_ended(self) -> str:
        """How it ended, for people."""
        code = self.process.returncode
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"ended with status {code}"
        return f"{self.name} {how}{self.last_words(': ')}"

    def last_words(self, before: str = "") -> str:
        if self.words is None or not self.words.exists():  # a cleaner of /tmp must not hide which one died
            return ""
        lines = self.words.read_text("utf-8", "replace").strip().splitlines()
        return before + lines[-1] if lines else ""

    def refusal(self) -> Exception:
        """Why it never began, as an error of the class its exit status stands for."""
        known = _CLASS_OF_STATUS.get(self.process.returncode)
        return known(self.last_words() or self.how_it_ended()) if known else Failed(self.how_it_ended())

    def wait(self, seconds: float) -> bool:
        """Give it time to leave by itself; whether it did."""
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def leave(self) -> None:
        """End it and what it started: asked first, killed when it does not listen."""
        if self.running:
            self.sent_away = True
            self._signal_group(signal.SIGTERM)
            self.wait(LEAVE_S)
            self._signal_group(signal.SIGKILL)
            self.process.wait()
        if self.tee is not None:
            self.tee.finish()

    def _signal_group(self, number: int) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, number)


def wait_s(asked_s: float | None, whose: str) -> float | None:
    """How long a side is awaited; None: for ever, one that somebody starts when it suits them."""
    return None if asked_s is None and whose == EXTERNAL else asked_s or BARRIER_S


def bus_environment(spec: str, vehicle: Path, craft: str) -> dict[str, str]:
    """What another software finds in its environment, on either side."""
    return {
        "GNSS_HIL_BUS": spec,
        "GNSS_HIL_VEHICLE": str(vehicle.absolute()),
        "GNSS_HIL_CRAFT": craft,
    }


def run_environment(plan: Plan, scenario: Path, pace: str) -> dict[str, str]:
    """What another emulator finds there besides."""
    return {
        "GNSS_HIL_SCENARIO": str(scenario.absolute()),
        "GNSS_HIL_PACE": pace,
        "GNSS_HIL_DURATION": f"{plan.scenario.time.duration_s:.12g}",
    }


def start(
    name: str,
    command: Sequence[str],
    words: Path | None,
    environment: Mapping[str, str] | None = None,
    pass_fds: Sequence[int] = (),
    log: Path | None = None,
) -> Child:
    """A child in a process group of its own: Ctrl-C reaches the supervisor, which ends children in order.
    `parent_death` ends it if the supervisor dies.

    words  file for its stderr; None lets it pass to ours
    log    file that keeps all it says, which passes to our stderr too
    environment   what it finds in its environment besides ours
    """
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", **(environment or {})}
    guarded = [sys.executable, "-I", "-S", parent_death.__file__, str(os.getpid()), *command]
    tee = Tee(log) if log else None
    kept = None if tee is None else tee.writing
    with nullcontext(kept) if words is None else words.open("wb") as stream:
        process = subprocess.Popen(
            guarded, stdin=subprocess.DEVNULL, stdout=kept, stderr=stream, env=environment, pass_fds=pass_fds,
            process_group=0,
        )  # fmt: skip
    if tee is not None:
        tee.begin()
    return Child(name, process, words, tee=tee)


def emulator_command(
    plan: Plan, config: RunConfig, folder: RunFolder, specs: Mapping[str, str], status: int
) -> list[str]:
    buses = [word for name, spec in specs.items() for word in ("--bus", f"{name}={spec}")]
    return [
        sys.executable, "-P", "-m", "gnss_hil.emulator",
        str(folder / SCENARIO), *buses, "--pace", config.pace,
        "--session", str(plan.session), "--truth", str(folder / TRUTH), "--status", f"fd:{status}", "--quiet",
        *(("--events", str(folder / FAULTS)) if plan.world.faults else ()),
        *(() if (limit_s := wait_s(config.wait_s, config.flight)) is None else ("--wait", f"{limit_s:.12g}")),
    ]  # fmt: skip


def flight_command(
    vehicle: Path,
    spec: str,
    policy: str,
    navigator: str | None,
    options: Iterable[str],
    status: int | None = None,
) -> list[str]:
    """Our flight software on a bus, for one run.

    options  of the flight, each KEY=VALUE
    status   descriptor of a pipe for what it flew
    """
    return [
        sys.executable, "-P", "-m", "gnss_hil.flightsw",
        "--vehicle", str(vehicle), "--bus", spec,
        "--once", "--quiet", "--policy", policy,
        *(() if navigator is None else ("--navigator", navigator)),
        *(() if status is None else ("--status", f"fd:{status}")),
        *(word for option in options for word in ("--option", option)),
    ]  # fmt: skip


def option_texts(options: Mapping[str, Value]) -> list[str]:
    """Options as a command line has them, each KEY=VALUE."""
    return [
        f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in options.items()
    ]


class StatusReader:
    """JSON lines of the emulator's status pipe; the last one stands."""

    def __init__(self, descriptor: int):
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor
        self._rest = b""
        self.last: dict[str, Any] = {}

    def poll(self) -> None:
        try:
            while piece := os.read(self._descriptor, 1 << 16):
                self._rest += piece
        except BlockingIOError:
            pass
        whole, newline, self._rest = self._rest.rpartition(b"\n")
        if newline:
            self.last |= json.loads(whole.splitlines()[-1])
