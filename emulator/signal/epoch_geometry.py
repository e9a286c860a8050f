"""A scene: one craft at one time mark, as far as receivers have no say in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gnss_hil.emulator.constellation.sky import SkyState
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.signal.geometry import Antennas, Array, Motion
from gnss_hil.emulator.signal.visibility import View

if TYPE_CHECKING:
    from gnss_hil.emulator.signal.structure_effects import Around


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What is true for one craft at one time mark, whatever its receivers do.

    in_sight  (n,) available and not behind the Earth
    signal    (m, n) strong enough to be found, inside the antenna's field of view
    held      (m, n) strong enough to be held once it is tracked; None: who has been found is held
    sun_ecef_m   (3,) the Sun
    around    the craft's structure, `emulator.signal.structure_effects.Around`; None without one
    clock_s   offset (m,) [s] and rate (m,) [s/s] of each receiver's clock;  by_domain_s (8,) offsets
    """

    t_ns: int
    sky: SkyState
    motion: Motion
    state: CraftState
    quaternion: Array
    rate_body_rps: Array
    antennas: Antennas
    view: View
    cn0_dbhz: Array
    in_sight: NDArray[np.bool_]
    signal: NDArray[np.bool_]
    held: NDArray[np.bool_] | None
    clock_s: tuple[Array, Array]
    by_domain_s: Array
    around: Around | None
    dcm_body_from_ecef: Array
    sun_ecef_m: Array
