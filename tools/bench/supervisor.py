"""Emulator and flight software as processes on buses, and whoever watches over them.

The supervisor owns the embedded buses' hubs (or listens on a foreign bus), feeds the recorders with what it
hears, tells who died, and ends everybody when asked to.
"""

from __future__ import annotations

import os
import shlex
import time
from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field

from dbc.codec import Codec
from dbc.link.hub import PrivateFolder
from tools.arguments import EXTERNAL, OURS
from tools.bench.children import LEAVE_S, Child, StatusReader, emulator_command, flight_command, start
from tools.bench.outcome import Outcome
from tools.bench.recorder import Recorder
from tools.bench.sequence import Epoch, Sequencer
from tools.bench.taps import Ear, embedded_bus, foreign_bus
from tools.errors import Failed
from tools.folder import RunFolder
from tools.live.display import Display
from tools.plan import Plan, vehicle_name

TURN_S = 0.03
"""Rhythm of the supervisor: how long frames may wait to be recorded."""

NO_ANSWER = (
    "the flight software does not answer BENCH_SYNC, every epoch waits for it in vain; use --pace realtime"
)

FAREWELL_S = 1.0
"""At the end of a run the flight software may be gone this much before the emulator."""


def play(
    plan: Plan,
    arguments: Namespace,
    folder: RunFolder,
    recorder: Recorder,
    display: Display,
    stop: Callable[[], bool],
) -> Outcome:
    """A run of processes; an error if it could not begin."""
    lockstep = arguments.pace == "lockstep"
    buses = [
        _Bus(number, codec, Ear(), Sequencer(codec, lockstep), recorder, display)
        for number, codec in enumerate(plan.codecs)
    ]
    with ExitStack() as stack:
        private = stack.enter_context(PrivateFolder())
        specs = {}
        for i, (name, bus) in enumerate(zip(plan.names, buses, strict=True)):
            way = (
                embedded_bus(private / f"can{i}", bus.ear)
                if arguments.bus == "embedded"
                else foreign_bus(arguments.bus, bus.ear)
            )
            specs[name] = stack.enter_context(way)
        reading, writing = os.pipe()
        stack.callback(os.close, reading)
        command = emulator_command(plan, arguments, folder, specs, writing)
        emulator = start("emulator", command, private / "emulator", pass_fds=(writing,))
        os.close(writing)
        stack.callback(emulator.leave)
        flights = []
        for i, (name, spec) in enumerate(specs.items()):
            vehicle = folder / vehicle_name(plan.names, i)
            if arguments.flight == EXTERNAL:
                display.note(f"waiting for the flight software of {name} on {spec}, vehicle file {vehicle}")
                continue
            ours = arguments.flight == OURS
            command = flight_command(plan, vehicle, i, spec) if ours else shlex.split(arguments.flight)
            told = {
                "GNSS_HIL_BUS": spec,
                "GNSS_HIL_VEHICLE": str(vehicle.absolute()),
                "GNSS_HIL_CRAFT": name,
            }
            words = private / f"flight-{i}" if ours else None  # a stranger's traceback is for its author
            flights.append(start(f"flight software of {name}", command, words, told))
            stack.callback(flights[-1].leave)
        watch = _Watch(plan, buses, display, StatusReader(reading), lockstep)
        failure = watch.until_over(emulator, flights, stop)
        return watch.outcome(failure, interrupted=stop())


@dataclass(slots=True, eq=False)
class _Bus:
    """One bus on its way into the record."""

    number: int
    codec: Codec
    ear: Ear
    sequencer: Sequencer
    recorder: Recorder
    display: Display
    last: Epoch | None = None

    def take(self) -> None:
        """Record the epochs that what was heard completes."""
        frames = self.ear.take()
        if len(frames):
            self._record(self.sequencer.hear(frames))

    def finish(self) -> None:
        self.take()
        self._record(self.sequencer.finish())

    def _record(self, closed: list[Epoch]) -> None:
        for epoch in closed:
            self.recorder.add(self.number, epoch.number, epoch.frames)
            self.display.hear(self.number, epoch.number, epoch.frames)
            self.last = epoch


@dataclass(slots=True, eq=False)
class _Watch:
    """The supervisor's rounds."""

    plan: Plan
    buses: list[_Bus]
    display: Display
    status: StatusReader
    lockstep: bool
    advised: bool = False
    begun: float = field(default_factory=time.perf_counter)

    def until_over(self, emulator: Child, flights: list[Child], stop: Callable[[], bool]) -> str:
        """Rounds until all have left; why the run broke off, "" if it did not.

        A run that never began is an error: of the one who refused, in his words, else of the first to end
        by itself. Whoever we sent away is to blame for nothing.
        """
        failure = ""
        while emulator.running:
            self._round()
            failure = failure or self._trouble(emulator, flights)
            if failure or stop():
                emulator.leave()
        if not failure and not stop() and emulator.process.returncode:
            failure = emulator.obituary()
        for flight in flights:
            if not failure and not stop() and flight.wait(LEAVE_S) and flight.process.returncode:
                failure = flight.obituary()
            flight.leave()
        for bus in self.buses:
            bus.finish()
        self.status.poll()
        if failure and not self._epochs:
            by_themselves = (child for child in (emulator, *flights) if not child.sent_away)
            refused = next((child for child in by_themselves if child.process.returncode in (2, 3)), None)
            raise refused.refusal() if refused else Failed(failure)
        return failure

    def _trouble(self, emulator: Child, flights: list[Child]) -> str:
        """Who broke off while the emulator goes on."""
        for bus in self.buses:
            if bus.ear.failure:
                return bus.ear.failure
        for flight in flights:
            if not flight.running and not (emulator.wait(FAREWELL_S) and emulator.process.returncode == 0):
                return flight.obituary()
        return ""

    def _round(self) -> None:
        time.sleep(TURN_S)
        for bus in self.buses:
            bus.take()
        self.status.poll()
        self._advise()
        self.display.refresh(self.status.last.get("epochs_unanswered", 0))

    def _advise(self) -> None:
        """Once, when lockstep goes on without a single answer: it looks hung, and is not."""
        epochs, unanswered = (self.status.last.get(key, 0) for key in ("epoch", "epochs_unanswered"))
        if self.lockstep and not self.advised and 0 < epochs == unanswered:
            self.advised = True
            self.display.note(NO_ANSWER)

    @property
    def _epochs(self) -> int:
        """Epochs on record."""
        last = self.buses[0].last
        return 0 if last is None else last.number + 1

    def outcome(self, failure: str, interrupted: bool) -> Outcome:
        said = self.status.last
        latency = said.get("epoch_latency_ms", {})

        def seconds(name: str) -> float | None:
            return None if latency.get(name) is None else latency[name] / 1e3

        return Outcome(
            self._epochs,
            said.get("epochs_unanswered", 0),
            said.get("wall_s") or time.perf_counter() - self.begun,
            seconds("p50"),
            seconds("p99"),
            sum(bus.sequencer.declared for bus in self.buses) or None,
            interrupted,
            failure,
        )
