"""Emulator and flight software in one process, batch to batch: the same frames, no bus in between."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from gnss_hil.dbc.contract.frames import EMPTY, concat
from gnss_hil.dbc.lockstep.latency import Latency
from gnss_hil.emulator import assemble
from gnss_hil.emulator.faults.engine import Event
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.tools.live.display import Display
from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.recording.recorder import Recorder
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
    configs = dict(zip(plan.names, plan.flights, strict=True))
    flown = {name: initial_state(config) for name, config in configs.items()}
    answers = dict.fromkeys(plan.names, EMPTY)
    epochs = plan.scenario.time.epochs
    latency, sent, epoch = Latency(), 0, 0
    gc.freeze()  # what was built before the loop lives through it: nothing there to collect
    begun = time.perf_counter()
    while epoch < epochs and not stop():
        emulated, blocks, rows = emulate_step(world, emulated, answers, epoch)
        heard = time.perf_counter()
        for bus, (name, config) in enumerate(configs.items()):
            heard = time.perf_counter()
            flown[name], answers[name] = flight_step(config, flown[name], blocks[name])
            latency.add(time.perf_counter() - heard)
            frames = concat((blocks[name], answers[name]))
            sent += len(frames)
            recorder.add(bus, epoch, frames)
            display.hear(bus, epoch, frames)
        truth.add(rows, heard)
        fates.add(emulated.events, heard)
        epoch += 1
        display.refresh()
    wall_s = time.perf_counter() - begun
    return Outcome(
        epoch,
        0,
        wall_s,
        latency.percentile_s(50),
        latency.percentile_s(99),
        sent,
        interrupted=epoch < epochs,
        latency_histogram=latency.histogram(),
    )
