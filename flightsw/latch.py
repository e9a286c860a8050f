"""From the instant of the latch to the time mark, where the two are not the same.

A mark may be what a receiver's own clock showed. All receivers then latched at GPS time mark - b, where b is
that clock's offset, and the fix is of that instant: in a low orbit 7.6 m away for each millisecond. It is
brought to GPS time = mark, along the orbit, by the very offset it has found.

What else depends on time does not notice: satellites' coordinates are those of their transmission instants,
and lever arms, which the attitude at the latch turns, would turn by 1e-6 rad in a millisecond.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flightsw.coast import propagate
from flightsw.earth import LIGHT_MPS
from flightsw.position import Fix, NoFix


def at_mark(fix: Fix, clock: int, carried_mps: NDArray[np.float64] | None) -> Fix | NoFix:
    """A fix of the latch as one of the mark.

    clock        the mark's, see `flightsw.epoch.Mark`
    carried_mps  (3,) velocity to go by where the fix has none, None if there is none either
    returns      NO_VELOCITY where nothing tells the way, TOO_FEW_SATELLITES where the clock that showed the
                 mark is not part of the fix
    """
    if clock == 0:
        return fix
    if clock - 1 not in fix.items:
        return NoFix.TOO_FEW_SATELLITES
    velocity = carried_mps if fix.velocity_mps is None else fix.velocity_mps
    if velocity is None:
        return NoFix.NO_VELOCITY
    offset_s = float(fix.clock_m[fix.items.index(clock - 1)]) / LIGHT_MPS
    position, velocity = propagate(fix.position_m, velocity, offset_s)
    return replace(fix, position_m=position, velocity_mps=None if fix.velocity_mps is None else velocity)
