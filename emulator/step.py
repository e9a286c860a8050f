"""One epoch of the emulator: a pure function from the state between epochs and commands received to frames.

What no command changes is worked out in blocks of epochs (`gnss_hil.emulator.environment`) and kept for as
long as it is near; a world answers the same whether a block is at hand or not. What commands change is
stepped here.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.emulator.state import EmulatorState, World
from gnss_hil.emulator.truth import TRUTH


def emulate_step(
    world: World, state: EmulatorState, inbox: Mapping[str, FrameBatch], epoch: int
) -> tuple[EmulatorState, dict[str, FrameBatch], NDArray]:
    """Play one epoch.

    inbox    frames received since the last epoch, by name of the craft whose bus they were on
    returns  next state; frames by craft; truth (crafts,) of dtype `gnss_hil.emulator.truth.TRUTH`
    """
    units, sent, truth = [], {}, np.zeros(len(world.craft), TRUTH)
    for number, (craft, unit) in enumerate(zip(world.craft, state.units, strict=True)):
        unit, sent[craft.name], truth[number] = craft.step(unit, inbox.get(craft.name, EMPTY), epoch)
        truth[number]["craft"] = number
        units.append(unit)
    return EmulatorState(tuple(units)), sent, truth


def prepare_step(world: World, state: EmulatorState, epoch: int) -> None:
    """Work for the epoch after a state, while frames are awaited: the step is quicker then, not other."""
    for craft, unit in zip(world.craft, state.units, strict=True):
        craft.prepare(unit, epoch)
