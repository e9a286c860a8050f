"""Velocity of the centre of mass and rates of the clocks, from the range rates of a fix."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.flightsw.estimation.least_squares import adjusted, least_squares
from gnss_hil.flightsw.integrity.exclusion import Rules, Trial, reconciled
from gnss_hil.flightsw.measurement import range_model
from gnss_hil.flightsw.measurement.observables import Ranges
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS

FASTEST_MPS = 13_421.0
"""What NAV_VX..NAV_VZ and NAV_DRIFT can carry; a rate beyond is no velocity."""


def velocity_and_drift(
    m: Ranges,
    geometry: NDArray[np.float64],
    rays: range_model.Rays,
    lever_rate_mps: NDArray[np.float64],
    rules: Rules,
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | tuple[None, None]:
    """Velocity (3,) and clock rates (c,), after the exclusion of satellites that contradict the others.

    None if the range rates contradict each other or the bus cannot carry what they say.

    geometry   (n, 3 + c) design of the position, known to be observable
    rays       from satellites to antennas where the craft is
    dP/dt = clock rate + rho' - satellite clock rate (1 - rho' / c), all by GPS time.
    """
    static, gain = range_model.rate_terms(rays, m.vel_sv_mps)
    stretch = 1 + m.clock_drift_mps / LIGHT_MPS
    gain = gain * stretch
    lever = np.einsum("in,in->n", rays.los, lever_rate_mps)
    design = geometry.copy()
    design[:, :3] *= gain[:, None]
    y = m.range_rate_mps + m.clock_drift_mps - stretch * static + gain * lever
    variance = m.rate_variance_m2ps2

    def fit(rows: NDArray[np.intp]) -> Trial | None:
        if len(rows) == len(y):
            x = adjusted(design, y, 1 / variance)
            return Trial(x, design, y - design @ x, variance)
        # A clock heard on the excluded satellite only has no rate any more: not observable.
        solution = least_squares(design[rows], y[rows], 1 / variance[rows])
        if solution is None:
            return None
        residual = y[rows] - design[rows] @ solution.x
        return Trial(solution.x, design[rows], residual, variance[rows])

    found = reconciled(fit, m.sat, rules)
    if found is None:
        return None, None
    x = found.trial.found
    return (x[:3], x[3:]) if np.abs(x).max() <= FASTEST_MPS else (None, None)
