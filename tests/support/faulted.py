"""An undisturbed run of `soyuz`, kept, and faults let loose on its frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cantools
import e2e.p11

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.emulator import assemble
from gnss_hil.emulator.faults import engine, files
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.emulator.faults.engine import Event, FaultPlan
from gnss_hil.emulator.step import emulate_step
from gnss_hil.flightsw.app.state import initial_state
from gnss_hil.flightsw.app.step import flight_step
from gnss_hil.tools.run_config import plan as plans
from gnss_hil.tools.run_config.config import Overrides

CODEC = codec(4)
VEHICLE = vehicle.load(vehicle.find("soyuz-ms"))
DATABASE = cantools.database.load_string(CODEC.text, "dbc")
NS = 1_000_000_000
EPOCHS = 130
SEED, SESSION = 1, 7


def play(epochs: int, *, faults: Sequence[str] = (), files: Sequence[str] = ()):
    """Emulator and flight software, epoch by epoch: blocks, answers, events of each."""
    changes = Overrides(duration_s=epochs, faults=tuple(faults), fault_files=tuple(map(Path, files)))
    plan = plans.make("soyuz", changes)
    state, flown, answer = assemble.initial_state(plan.world), initial_state(plan.flights[0]), EMPTY
    for epoch in range(epochs):
        state, sent, _ = emulate_step(plan.world, state, {"soyuz": answer}, epoch)
        block = sent["soyuz"]
        flown, answer = flight_step(plan.flights[0], flown, block)
        yield block, answer, state.events[0] if state.events else ()


@cache
def undisturbed(epochs: int = EPOCHS) -> tuple[tuple[FrameBatch, FrameBatch], ...]:
    """Blocks and answers of each epoch."""
    return tuple((block, answer) for block, answer, _ in play(epochs))


def plan_of(*lines: str, seed: int = SEED, link: str | None = None) -> FaultPlan:
    """Faults of lines, armed on the bus of soyuz."""
    faults = [files.of_line(line) for line in lines]
    return engine.armed(faults, "soyuz", VEHICLE, CODEC, NS, seed, SESSION, link)


@dataclass(frozen=True)
class Struck:
    """An epoch: frames before and after, of both directions, and what acted."""

    before: FrameBatch
    block: FrameBatch
    answer: FrameBatch
    events: tuple[Event, ...]


def strike(*lines: str, epochs: int = EPOCHS, seed: int = SEED) -> list[Struck]:
    """Faults on the frames of the undisturbed run."""
    plan = plan_of(*lines, seed=seed)
    state, found = engine.fresh(plan), []
    for epoch, (block, answer) in enumerate(undisturbed()[:epochs]):
        at = At(epoch, int(block.t_ns[0]), Direction.FLIGHT)
        state, struck, events = engine.inject(plan, state, block, at)
        at = At(epoch, int(block.t_ns[0]), Direction.RECEIVERS)
        state, heard, more = engine.inject(plan, state, answer, at)
        found.append(Struck(block, struck, heard, events + more))
    return found


def of_kind(frames: FrameBatch, name: str) -> FrameBatch:
    """Frames of a kind, by name."""
    return frames[CODEC.kind_of[frames.can_id & 0x7FF] == CODEC.kinds[name].number]


def by_cantools(frames: FrameBatch) -> list[dict]:
    """Signals of frames as cantools has them, numbers for labels."""
    return [
        DATABASE.decode_message(int(can_id), bytes(data), decode_choices=False)
        for can_id, data in zip(frames.can_id, frames.data, strict=True)
    ]


def sound(can_id: int, data: bytes) -> bool:
    """Whether AUTOSAR's library finds the CRC valid."""
    theirs = bytearray(data)
    e2e.p11.e2e_p11_protect(theirs, int(can_id), increment_counter=False)
    return theirs[0] == data[0]


def all_sound(frames: FrameBatch) -> bool:
    return all(sound(i, bytes(d)) for i, d in zip(frames.can_id, frames.data, strict=True))
