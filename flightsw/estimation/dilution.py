"""PDOP of a fix whose navigator states none: filters have no design matrix of one epoch."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.clocks import clock_columns
from gnss_hil.flightsw.estimation.least_squares import least_squares
from gnss_hil.flightsw.measurement.budget import independent
from gnss_hil.flightsw.measurement.code_range import code_ranges
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import MAX_PDOP, Fix, Solution


def with_dilution(solution: Solution, z: Ranges, inputs: FixInputs) -> Solution:
    """With a PDOP where there is a fix without one."""
    fix = solution.fix
    if fix is None or fix.pdop is not None:
        return solution
    return replace(solution, fix=replace(fix, pdop=pdop(fix, z, inputs)))


def pdop(fix: Fix, z: Ranges, inputs: FixInputs) -> float:
    """Position dilution over the measurements used, of a solution of this epoch alone; at most what the
    contract can state, also where the epoch alone would have no solution. Lever arms turn no ray by more than
    1e-6 rad: they are left out."""
    used = z[np.flatnonzero(fix.used)]
    domain, none = inputs.domain[used.receiver], np.zeros((3, len(used)))
    _, clocks = clock_columns(domain, used.sat // NUMBERS)
    code = code_ranges(used, none, clocks, independent(np.ones(len(used))))
    estimate = least_squares(code.design(code.rays(fix.position_m)), none[0], np.ones(len(used)))
    if estimate is None:
        return MAX_PDOP
    return min(sqrt(estimate.cofactor.diagonal()[:3].sum()), MAX_PDOP)
