"""Emulator and flight software as processes on buses, and their supervision.

The supervisor owns the embedded buses' hubs (or listens on a foreign bus) and starts what is to be started on
either side, ours or another's. `gnss_hil.tools.processes.supervision` has its rounds.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.tools.live.display import Display
from gnss_hil.tools.processes import reference as judging
from gnss_hil.tools.processes.bus_session import BusSession
from gnss_hil.tools.processes.bus_tap import BusTap, embedded_bus, foreign_bus
from gnss_hil.tools.processes.children import (
    Child,
    StatusReader,
    bus_environment,
    emulator_command,
    flight_command,
    option_texts,
    run_environment,
    start,
    wait_s,
)
from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.processes.supervision import ReportingMaster, Supervision, WatchedMaster
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.recording.run_folder import SCENARIO, RunFolder, vehicle_name
from gnss_hil.tools.recording.sequence import Sequencer
from gnss_hil.tools.run_config.config import EXTERNAL, OURS, RunConfig
from gnss_hil.tools.run_config.plan import Plan


def play(
    plan: Plan,
    config: RunConfig,
    folder: RunFolder,
    recorder: Recorder,
    display: Display,
    stop: Callable[[], bool],
) -> Outcome:
    """A run of processes; an error if it could not begin."""
    watched, time = config.emulator != OURS, plan.scenario.time
    sessions = [
        BusSession(
            number=number, codec=codec, tap=BusTap(),
            sequencer=Sequencer(codec, config.pace == "lockstep", None if watched else plan.session),
            recorder=recorder, display=display, watched=watched,
            end_ns=time.epochs * time.interval_ns, interval_ns=time.interval_ns,
        )
        for number, codec in enumerate(plan.codecs)
    ]  # fmt: skip
    with ExitStack() as stack:
        runtime_dir = stack.enter_context(RuntimeDir())
        specs = {
            name: stack.enter_context(_way(config.bus, runtime_dir / f"can{session.number}", session.tap))
            for name, session in zip(plan.names, sessions, strict=True)
        }
        processes = _Processes(plan, config, folder, runtime_dir, specs, display, stack)
        if watched:
            refusal = partial(judging.refusal, plan.scenario, config.overrides.reference)
            master = WatchedMaster(
                processes.other_emulators(), sessions, time.epochs,
                refusal, wait_s(config.wait_s, config.emulator),
            )  # fmt: skip
        else:
            master = ReportingMaster(*processes.our_emulator())
        supervision = Supervision(sessions, display, master, processes.flights(), config.pace == "lockstep")
        failure = supervision.until_over(stop)
        return supervision.outcome(failure, interrupted=stop())


@contextmanager
def _way(bus: str, runtime_dir: Path, tap: BusTap) -> Iterator[str]:
    """A craft's bus, ours or a foreign one, for as long as the context lasts; its specification."""
    interface, _, path = bus.partition(":")
    with (
        embedded_bus(Path(path or runtime_dir), tap)
        if interface == "embedded"
        else foreign_bus(bus, tap) as way
    ):
        yield way


class _Processes:
    """Starts the processes of a run; those that still run when `stack` closes are ended."""

    def __init__(
        self,
        plan: Plan,
        config: RunConfig,
        folder: RunFolder,
        runtime_dir: Path,
        specs: Mapping[str, str],
        display: Display,
        stack: ExitStack,
    ):
        self._plan, self._config, self._folder = plan, config, folder
        self._runtime_dir, self._specs, self._display, self._stack = runtime_dir, specs, display, stack

    def our_emulator(self) -> tuple[Child, StatusReader]:
        """One process for all craft, which reports to us."""
        reading, writing = os.pipe()
        self._stack.callback(os.close, reading)
        command = emulator_command(self._plan, self._config, self._folder, self._specs, writing)
        child = start("emulator", command, self._runtime_dir / "emulator", pass_fds=(writing,))
        os.close(writing)
        self._stack.callback(child.leave)
        return child, StatusReader(reading)

    def other_emulators(self) -> list[Child]:
        """One process for each craft, unless they are started elsewhere."""
        scenario = self._folder / SCENARIO
        added = run_environment(self._plan, scenario, self._config.pace)
        files = f"scenario file {scenario}, "
        return self._others("emulator", self._config.emulator, added, files, "emulator")

    def flights(self) -> list[Child]:
        """The flight software of each craft, unless it is started elsewhere."""
        if self._config.flight != OURS:
            return self._others("flight software", self._config.flight, {}, "", "flight")
        children = []
        for i, (name, spec) in enumerate(self._specs.items()):
            flight = self._plan.scenario.craft[i].flight
            options = option_texts(flight.options)
            reading, writing = os.pipe()
            self._stack.callback(os.close, reading)
            command = flight_command(
                self._vehicle(i), spec, flight.policy, flight.navigator, options, writing
            )
            words = self._runtime_dir / f"flight-{i}"
            child = start(f"flight software of {name}", command, words, pass_fds=(writing,))
            os.close(writing)
            child.status = StatusReader(reading)
            self._stack.callback(child.leave)
            children.append(child)
        return children

    def _others(self, role: str, command: str, added: Mapping[str, str], also: str, log: str) -> list[Child]:
        """Another's software; what it says passes through, a traceback is for its author, and is kept."""
        children = []
        for i, (name, spec) in enumerate(self._specs.items()):
            vehicle = self._vehicle(i)
            if command == EXTERNAL:
                files = f"{also}vehicle file {vehicle}"
                self._display.note(f"waiting for the {role} of {name} on {spec}, {files}")
                continue
            environment = {**bus_environment(spec, vehicle, name), **added}
            kept = self._folder / (f"{log}.log" if len(self._specs) == 1 else f"{log}-{name}.log")
            child = start(f"{role} of {name}", shlex.split(command), None, environment, log=kept)
            self._stack.callback(child.leave)
            children.append(child)
        return children

    def _vehicle(self, i: int) -> Path:
        return self._folder / vehicle_name(self._plan.names, i)
