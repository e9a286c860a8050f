"""What a combination of antennas may ask for beside the measurements, and a fix of one antenna alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gnss_hil.flightsw.attitude.attitude import Attitude
from gnss_hil.flightsw.estimation.position import Fix, NoFix, solve
from gnss_hil.flightsw.integrity.exclusion import STRICT, Rules
from gnss_hil.flightsw.measurement.observables import Ranges


@dataclass(frozen=True, slots=True)
class Circumstances:
    """Of one epoch.

    attitude           None if there is none
    lever_arm_body_m   (m, 3) antennas relative to the centre of mass
    domain             (m,) clock domain of each antenna
    start_m            (3,) where the search for the position starts; None: the Earth's centre
    ura_scale          how much of the broadcast URA counts
    rules              what becomes of measurements that disagree
    leading            antenna that led in the epoch before, where one does; -1 none
    """

    attitude: Attitude | None
    lever_arm_body_m: NDArray[np.float64]
    domain: NDArray[np.int64]
    start_m: NDArray[np.float64] | None
    ura_scale: float
    rules: Rules = STRICT
    leading: int = -1


def solve_alone(m: Ranges, antenna: int, at: Circumstances) -> Fix | NoFix:
    """The fix of one antenna by itself, for the antenna's own place; arrays over all n measurements."""
    rows = np.flatnonzero(m.receiver == antenna)
    none = np.zeros((3, len(rows)))
    fix = solve(m[rows], none, none, at.domain[m.receiver[rows]], at.start_m, at.ura_scale, at.rules)
    return fix if isinstance(fix, NoFix) else _spread(fix, rows, len(m))


def _spread(fix: Fix, rows: NDArray[np.intp], n: int) -> Fix:
    """A fix from some rows as one from all n, the others unused."""
    used, residual, gain = np.zeros(n, bool), np.full(n, np.nan), np.zeros((3, n))
    used[rows], residual[rows], gain[:, rows] = fix.used, fix.residual_m, fix.gain
    return replace(fix, used=used, residual_m=residual, gain=gain)
