"""Emulator and flight software as processes on buses, and whoever watches over them.

The supervisor owns the embedded buses' hubs (or listens on a foreign bus) and starts what is to be started on
either side, ours or somebody else's. `tools.processes.supervision` has its rounds.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from gnss_hil.dbc.bus.runtime_dir import PrivateFolder
from gnss_hil.tools.live.display import Display
from gnss_hil.tools.processes.bus_session import Line
from gnss_hil.tools.processes.bus_tap import Ear, embedded_bus, foreign_bus
from gnss_hil.tools.processes.children import (
    Child,
    StatusReader,
    emulator_command,
    flight_command,
    start,
    told_of_bus,
    told_of_run,
)
from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.processes.supervision import ReportingMaster, Watch, WatchedMaster
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
    lines = [
        Line(
            number=number, codec=codec, ear=Ear(),
            sequencer=Sequencer(codec, config.pace == "lockstep"),
            recorder=recorder, display=display, watched=watched,
            end_ns=time.epochs * time.interval_ns, interval_ns=time.interval_ns,
        )
        for number, codec in enumerate(plan.codecs)
    ]  # fmt: skip
    with ExitStack() as stack:
        private = stack.enter_context(PrivateFolder())
        specs = {
            name: stack.enter_context(_way(config.bus, private / f"can{line.number}", line.ear))
            for name, line in zip(plan.names, lines, strict=True)
        }
        crew = _Crew(plan, config, folder, private, specs, display, stack)
        if watched:
            master = WatchedMaster(crew.other_emulators(), lines, time.epochs)
        else:
            master = ReportingMaster(*crew.our_emulator())
        watch = Watch(lines, display, master, crew.flights(), config.pace == "lockstep")
        failure = watch.until_over(stop)
        return watch.outcome(failure, interrupted=stop())


@contextmanager
def _way(bus: str, private: Path, ear: Ear) -> Iterator[str]:
    """A craft's bus, ours or a foreign one, for as long as the context lasts; its specification."""
    interface, _, path = bus.partition(":")
    with (
        embedded_bus(Path(path or private), ear) if interface == "embedded" else foreign_bus(bus, ear) as way
    ):
        yield way


class _Crew:
    """Starts the processes of a run; whoever is still there when `stack` closes is sent away."""

    def __init__(
        self,
        plan: Plan,
        config: RunConfig,
        folder: RunFolder,
        private: Path,
        specs: Mapping[str, str],
        display: Display,
        stack: ExitStack,
    ):
        self._plan, self._config, self._folder = plan, config, folder
        self._private, self._specs, self._display, self._stack = private, specs, display, stack

    def our_emulator(self) -> tuple[Child, StatusReader]:
        """One process for all craft, which reports to us."""
        reading, writing = os.pipe()
        self._stack.callback(os.close, reading)
        command = emulator_command(self._plan, self._config, self._folder, self._specs, writing)
        child = start("emulator", command, self._private / "emulator", pass_fds=(writing,))
        os.close(writing)
        self._stack.callback(child.leave)
        return child, StatusReader(reading)

    def other_emulators(self) -> list[Child]:
        """One process for each craft, unless somebody starts them."""
        scenario = self._folder / SCENARIO
        told = told_of_run(self._plan, scenario, self._config.pace)
        return self._others("emulator", self._config.emulator, told, f"scenario file {scenario}, ")

    def flights(self) -> list[Child]:
        """The flight software of each craft, unless somebody starts it."""
        if self._config.flight != OURS:
            return self._others("flight software", self._config.flight, {}, "")
        children = []
        for i, (name, spec) in enumerate(self._specs.items()):
            command = flight_command(self._plan, self._vehicle(i), i, spec)
            child = start(f"flight software of {name}", command, self._private / f"flight-{i}")
            self._stack.callback(child.leave)
            children.append(child)
        return children

    def _others(self, role: str, command: str, told: Mapping[str, str], also: str) -> list[Child]:
        """Somebody else's software; its words pass through: a traceback is for its author."""
        children = []
        for i, (name, spec) in enumerate(self._specs.items()):
            vehicle = self._vehicle(i)
            if command == EXTERNAL:
                files = f"{also}vehicle file {vehicle}"
                self._display.note(f"waiting for the {role} of {name} on {spec}, {files}")
                continue
            environment = {**told_of_bus(spec, vehicle, name), **told}
            child = start(f"{role} of {name}", shlex.split(command), None, environment)
            self._stack.callback(child.leave)
            children.append(child)
        return children

    def _vehicle(self, i: int) -> Path:
        return self._folder / vehicle_name(self._plan.names, i)
