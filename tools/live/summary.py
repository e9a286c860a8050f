"""What the live view shows: one craft, and the run as a whole."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gnss_hil.dbc.common.vehicle import Vehicle
from gnss_hil.tools.decoder.epoch_snapshot import EpochSnapshot
from gnss_hil.tools.decoder.latest import Latest
from gnss_hil.tools.live.chart import History


@dataclass(frozen=True, slots=True, eq=False)
class CraftSummary:
    """One craft and its bus, as they are at a look.

    bus         its channels' tracks, its load, its frames as counted since the start
    snapshot    the last epoch
    interval_s  between epochs
    error_m     3-D, centre of mass, against the truth; None where there is no fix or no truth yet
    history     error and satellites at the looks so far
    """

    name: str
    vehicle: Vehicle
    bus: Latest
    snapshot: EpochSnapshot
    interval_s: float
    error_m: float | None
    history: History = field(default_factory=History)

    @property
    def tracked(self) -> int:
        """Distinct satellites that channels deliver."""
        sat = self.bus.tracks.sat
        return len(np.unique(sat[sat >= 0]))


@dataclass(frozen=True, slots=True)
class FaultsSummary:
    """Names of faults that act, have acted, and are armed and have not yet."""

    acting: tuple[str, ...]
    over: tuple[str, ...]
    armed: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class RunSummary:
    """The run.

    pace     simulated seconds in a second, of late; None in the first second
    faults   None where none are armed
    """

    scenario: str
    epoch: int
    simulated_s: float
    duration_s: float
    pace: float | None
    unanswered: int
    craft: tuple[CraftSummary, ...]
    notes: tuple[str, ...] = ()
    faults: FaultsSummary | None = None
