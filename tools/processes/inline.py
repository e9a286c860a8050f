"""Emulator and flight software in one process, batch to batch: the same frames, no bus in between."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.dbc.lockstep.latency import Latency
from gnss_hil.emulator import assemble
from gnss_hil.emulator.faults.engine import Event
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.config import FlightConfig
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.tools.live.display import Display
from gnss_hil.tools.processes.inline_bus import Direct, Fly, Steered
from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.recording.account import Counted
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.recording.sequence import Epoch
from gnss_hil.tools.run_config.plan import Plan


class TruthSink(Protocol):
    """Takes the truth of each epoch."""

    def add(self, rows: np.ndarray, now_s: float) -> None:
        """Rows of the craft, at a wall-clock time."""


@contextmanager
def _thawed() -> Iterator[None]:
    """What was frozen within is garbage like any other afterwards, for a program that plays many runs; what
    the program froze itself stays so."""
    own = gc.get_freeze_count()
    try:
        yield
    finally:
        if not own:
            gc.unfreeze()


class FaultSink(Protocol):
    """Takes what faults did in each epoch."""

    def add(self, events: Sequence[Sequence[Event]], now_s: float) -> None:
        """Events of each craft, at a wall-clock time."""


class _Flight:
    """The flight software of a craft, timed."""

    def __init__(self, config: FlightConfig, latency: Latency):
        self._config, self._latency = config, latency
        self._state = initial_state(config)

    def __call__(self, block: FrameBatch, fresh: bool) -> FrameBatch:
        """Its answer to a block, from a fresh state or on from the last."""
        begun = time.perf_counter()
        state = initial_state(self._config) if fresh else self._state
        self._state, answer = flight_step(self._config, state, block)
        self._latency.add(time.perf_counter() - begun)
        return answer


def _way(plan: Plan, number: int, fly: Fly) -> Direct | Steered:
    """How frames of a craft go: between both sides of lockstep where faults are armed."""
    return Steered(plan.codecs[number], plan.session, fly) if plan.world.faults else Direct(fly)


@_thawed()
def play(
    plan: Plan,
    recorder: Recorder,
    truth: TruthSink,
    fates: FaultSink,
    display: Display,
    stop: Callable[[], bool],
) -> Outcome:
    """All epochs of a plan, as fast as they go; `stop` ends them early."""
    world = plan.world
    emulated = assemble.initial_state(world)
    latency = Latency()
    ways = [_way(plan, number, _Flight(config, latency)) for number, config in enumerate(plan.flights)]
    answers = dict.fromkeys(plan.names, EMPTY)
    epochs = plan.scenario.time.epochs
    sent = epoch = unanswered = 0
    recorded = [0] * len(ways)

    def record(bus: int, closed: Sequence[Epoch]) -> int:
        recorded[bus] += len(closed)
        for one in closed:
            recorder.add(bus, one.number, one.frames)
            display.hear(bus, one.number, one.frames)
        return sum(len(one.frames) for one in closed)

    gc.freeze()  # what was built before the loop lives through it: nothing there to collect
    begun = time.perf_counter()
    while epoch < epochs and not stop():
        emulated, blocks, rows = emulate_step(world, emulated, answers, epoch)
        answered = True
        for bus, (name, way) in enumerate(zip(plan.names, ways, strict=True)):
            played = way.play(epoch, blocks[name])
            answers[name] = played.inbox
            answered &= played.answered
            sent += record(bus, played.epochs)
        unanswered += not answered
        now_s = time.perf_counter()
        truth.add(rows, now_s)
        fates.add(emulated.events, now_s)
        epoch += 1
        display.refresh()
    for bus, way in enumerate(ways):
        sent += record(bus, way.end(epoch, "COMPLETED" if epoch == epochs else "INTERRUPTED"))
    wall_s = time.perf_counter() - begun
    heard = tuple(found for bus, way in enumerate(ways) if (found := way.account(recorded[bus])))
    return Outcome(
        epoch,
        unanswered,
        wall_s,
        latency.percentile_s(50),
        latency.percentile_s(99),
        sent,
        interrupted=epoch < epochs,
        latency_histogram=latency.histogram(),
        heard=heard,
        counted=(Counted(),) * len(heard),
    )
