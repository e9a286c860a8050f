"""The fix of one antenna by itself: its own place, no lever arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Index
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.least_squares import scattered
from gnss_hil.flightsw.estimation.position import solve
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import NoFix, SnapshotFix


def antenna_alone(m: Ranges, antenna: int, inputs: FixInputs, start_m: F64 | None) -> SnapshotFix | NoFix:
    """The fix of one antenna; its arrays are over all n measurements of m."""
    rows = np.flatnonzero(m.receiver == antenna)
    none = np.zeros((3, len(rows)))
    domain = inputs.domain[m.receiver[rows]]
    fix = solve(m[rows], none, none, domain, start_m, inputs.budget, inputs.ionosphere, inputs.rules)
    return fix if isinstance(fix, NoFix) else _spread(fix, rows, len(m))


def _spread(fix: SnapshotFix, rows: Index, n: int) -> SnapshotFix:
    """A fix from some rows as one from all n, the others unused."""
    of_velocity = fix.velocity_gain
    used = np.zeros(n, bool)
    used[rows] = fix.used
    return replace(
        fix,
        used=used,
        residual_m=scattered(fix.residual_m, rows, n, np.nan),
        gain=scattered(fix.gain, rows, n, 0.0),
        velocity_gain=None if of_velocity is None else scattered(of_velocity, rows, n, 0.0),
    )
