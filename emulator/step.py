"""One epoch of the emulator: a pure function from the state between epochs and commands received to frames.

What no command changes is worked out in blocks of epochs (`gnss_hil.emulator.environment`) and kept for as
long as it is near; a world answers the same whether a block is at hand or not. What commands change is
stepped here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.emulator.faults.engine import Event, FaultState, inject
from gnss_hil.emulator.state import EmulatorState, World
from gnss_hil.emulator.truth import TRUTH


def emulate_step(
    world: World, state: EmulatorState, inbox: Mapping[str, FrameBatch], epoch: int
) -> tuple[EmulatorState, dict[str, FrameBatch], NDArray]:
    """Play one epoch.

    inbox    frames received since the last epoch, by name of the craft whose bus they were on
    returns  next state; frames by craft; truth (crafts,) of dtype `gnss_hil.emulator.truth.TRUTH`
    What faults there are strike what comes in, as answers to the epoch before, and what goes out.
    """
    if world.faults:
        return _with_faults(world, state, inbox, epoch)
    return _stepped(world, state, inbox, epoch)


def _stepped(
    world: World, state: EmulatorState, inbox: Mapping[str, FrameBatch], epoch: int
) -> tuple[EmulatorState, dict[str, FrameBatch], NDArray]:
    units, sent, truth = [], {}, np.zeros(len(world.craft), TRUTH)
    for number, (craft, unit) in enumerate(zip(world.craft, state.units, strict=True)):
        unit, sent[craft.name], truth[number] = craft.step(unit, inbox.get(craft.name, EMPTY), epoch)
        truth[number]["craft"] = number
        units.append(unit)
    return EmulatorState(tuple(units)), sent, truth


def _with_faults(
    world: World, state: EmulatorState, inbox: Mapping[str, FrameBatch], epoch: int
) -> tuple[EmulatorState, dict[str, FrameBatch], NDArray]:
    """An epoch between faults on what comes in and faults on what goes out."""
    names = [craft.name for craft in world.craft]
    faults, heard, before = _struck(world, state.faults, inbox, epoch - 1, Direction.RECEIVERS)
    after, blocks, truth = _stepped(world, state, heard, epoch)
    faults, sent, behind = _struck(world, faults, blocks, epoch, Direction.FLIGHT)
    events = tuple(before[name] + behind[name] for name in names)
    return EmulatorState(after.units, faults, events), sent, truth


def _struck(
    world: World, states: Sequence[FaultState], frames: Mapping[str, FrameBatch], epoch: int, way: Direction
) -> tuple[tuple[FaultState, ...], dict[str, FrameBatch], dict[str, tuple[Event, ...]]]:
    """Frames by craft as the faults of an epoch leave them."""
    kept, struck, events = [], {}, {}
    at = At(epoch, world.start_ns + epoch * world.interval_ns, way)
    for craft, plan, state in zip(world.craft, world.faults, states, strict=True):
        fate, struck[craft.name], events[craft.name] = inject(plan, state, frames.get(craft.name, EMPTY), at)
        kept.append(fate)
    return tuple(kept), struck, events


def prepare_step(world: World, state: EmulatorState, epoch: int) -> None:
    """Work for the epoch after a state, while frames are awaited: the step is quicker then, not other."""
    for craft, unit in zip(world.craft, state.units, strict=True):
        craft.prepare(unit, epoch)
