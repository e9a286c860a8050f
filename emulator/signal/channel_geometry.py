"""The measured signals of a craft, and what disturbs them: one row for each measuring channel."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.emulator.signal.epoch_geometry import Scene
from gnss_hil.emulator.signal.geometry import Array, Path
from gnss_hil.emulator.signal.multipath_engine import Reception

Numbers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """Signals from satellites to antennas at one latch, one row for each measuring channel.

    receiver, channel (p,) 0-based;  row (p,) of the sky;  sat, system (p,) satellite index and its system
    wave_m, chip_m    (p,) lengths of carrier wave and code chip [m]
    cn0_dbhz          (p,)
    path              from transmission to reception
    words             (p, SLOTS) random words of receiver and satellite in this epoch, `draws.grid`
    reception         what reflections do to them, None without any
    """

    scene: Scene
    receiver: Numbers
    channel: Numbers
    row: Numbers
    sat: Numbers
    system: Numbers
    wave_m: Array
    chip_m: Array
    cn0_dbhz: Array
    path: Path
    words: NDArray[np.uint64] | None
    reception: Reception | None

    def __len__(self) -> int:
        return len(self.row)


@dataclass(frozen=True, slots=True, eq=False)
class Disturbance:
    """What is added to the observables, (p,) each or one number for all.

    range_m [m] to the pseudorange, phase_m [m] to the carrier phase, rate_mps [m/s] to the range rate
    """

    range_m: Array | float = 0.0
    phase_m: Array | float = 0.0
    rate_mps: Array | float = 0.0

    def __add__(self, other: Disturbance) -> Disturbance:
        return Disturbance(
            self.range_m + other.range_m, self.phase_m + other.phase_m, self.rate_mps + other.rate_mps
        )


Effect = Callable[[Rays], Disturbance]
"""A factor at work on measured signals."""

NONE = Disturbance()


def total(effects: Iterable[Effect], rays: Rays) -> Disturbance:
    """The sum of all effects."""
    return sum((effect(rays) for effect in effects), NONE) if len(rays) else NONE
