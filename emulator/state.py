"""What the emulator is made of: worlds that do not change in a run, and states between epochs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.emulator.constellation.sky import Sky
from gnss_hil.emulator.faults.engine import Event, FaultPlan, FaultState
from gnss_hil.emulator.receivers.base import Craft, Unit


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """What does not change in a run.

    row_of   (SATELLITES,) row of the sky by satellite index, -1 none
    remarks  on what is odd in the scenario's files, a line each
    faults   of each craft's bus, in the scenario's order; none where there are none
    """

    seed: int
    session: int
    start_ns: int
    interval_ns: int
    sky: Sky
    row_of: I64
    craft: tuple[Craft, ...]
    remarks: tuple[str, ...] = ()
    faults: tuple[FaultPlan, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class EmulatorState:
    """All craft between epochs, in the scenario's order.

    faults   of each bus that has some;  events  of each: faults that acted in the last epoch
    """

    units: tuple[Unit, ...]
    faults: tuple[FaultState, ...] = ()
    events: tuple[tuple[Event, ...], ...] = ()


def commands_rejected(state: EmulatorState) -> dict[str, int]:
    """Command frames that all craft have rejected so far, by reason; only reasons that occurred."""
    total = np.sum([unit.refused for unit in state.units], axis=0)
    return {verdict.name: int(total[verdict]) for verdict in Verdict if total[verdict]}
