"""What the live view knows: one craft, and the run as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.tools.decoder.epoch_snapshot import EpochSnapshot


@dataclass(frozen=True, slots=True, eq=False)
class CraftSummary:
    """One craft and its bus.

    antennas, channels    (m,) names and numbers of channels by the vehicle file
    sat, asked            (m, CHANNELS) satellite delivered, satellite commanded; -1 none
    age_s                 (m, CHANNELS) how long the satellite has come without a gap
    error_m               3-D, centre of mass, against the truth; None if not known
    rejected              reason -> frames since the start
    """

    name: str
    antennas: tuple[str, ...]
    channels: NDArray[np.int64]
    snapshot: EpochSnapshot
    sat: NDArray[np.int64]
    asked: NDArray[np.int64]
    age_s: NDArray[np.float64]
    error_m: float | None
    load_percent: float
    load_most_percent: float
    frames: int
    lost: int
    rejected: Mapping[str, int]

    @property
    def tracked(self) -> int:
        """Distinct satellites that channels deliver."""
        return len(np.unique(self.sat[self.sat >= 0]))


@dataclass(frozen=True, slots=True, eq=False)
class RunSummary:
    """The run. pace: simulated seconds in a second, of late; None before it is known."""

    scenario: str
    epoch: int
    simulated_s: float
    duration_s: float
    pace: float | None
    unanswered: int
    craft: tuple[CraftSummary, ...]
    notes: tuple[str, ...] = ()
