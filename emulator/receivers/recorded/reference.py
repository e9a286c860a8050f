"""Where a craft has been by its reference orbit, at the tags of a receiver.

A table of states and the tags of a receiver hardly ever begin and end in the same nanosecond. Within a
hundredth of the table's step beyond its ends a motion goes on as it was: for a step of a minute in low orbit
that is wrong by less than a millimetre. Farther away nothing is known, and that is told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.emulator.orbits.dynamics import CraftState
from gnss_hil.emulator.orbits.motion import Flown

_SHARE = 100


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A reference orbit; reach_ns beyond its ends, and into its gaps, it goes on."""

    flown: Flown
    reach_ns: int

    def holds(self, t_ns: int) -> bool:
        """Whether it is known where the craft was at GPS time t_ns."""
        return self._nearest(t_ns) is not None

    def at(self, t_ns: int) -> CraftState:
        """The state at a GPS time that is held."""
        held_ns = self._nearest(t_ns)
        assert held_ns is not None, "asked of what is held"
        state, since_s = self.flown.at(held_ns), (t_ns - held_ns) / gpstime.NS_PER_S
        if not since_s:
            return state
        pos: F64 = state.pos_ecef_m + since_s * (state.vel_ecef_mps + since_s / 2 * state.acc_ecef_mps2)
        return CraftState(pos, state.vel_ecef_mps + since_s * state.acc_ecef_mps2, state.acc_ecef_mps2)

    def known(self, t_ns: I64) -> Bool:
        """(q,) whether each of some GPS times is held."""
        return np.array([self.holds(t) for t in t_ns.tolist()], bool)

    def _nearest(self, t_ns: int) -> int | None:
        """The time itself, or the held one within reach; None where there is none."""
        reached = (t_ns, t_ns + self.reach_ns, t_ns - self.reach_ns)
        return next((t for t in reached if self.flown.holds(t)), None)


def reference(flown: Flown) -> Reference:
    """The reference that a trajectory is."""
    return Reference(flown, int(np.median(np.diff(flown.t_ns))) // _SHARE)
