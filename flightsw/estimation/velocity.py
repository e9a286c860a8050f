"""Velocity of the centre of mass and rates of the clocks, from the range rates of a fix."""

from __future__ import annotations

from gnss_hil.dbc.common.arrays import F64, I64, Index
from gnss_hil.flightsw.estimation.least_squares import adjusted, least_squares
from gnss_hil.flightsw.integrity import exclusion
from gnss_hil.flightsw.integrity.exclusion import Rules, Trial
from gnss_hil.flightsw.measurement.range_rate import RangeRates
from gnss_hil.flightsw.records.solution import FASTEST_MPS, within


def velocity_and_drift(z: RangeRates, sat: I64, rules: Rules) -> tuple[F64, F64] | tuple[None, None]:
    """Velocity (3,) and clock rates (c,), after the exclusion of satellites that contradict the others.

    None if the range rates contradict each other or the bus cannot carry what they give.

    z     along rays of a position that these measurements made observable
    sat   (n,) satellite of each
    """
    design, variance = z.design, z.variance
    y = z.value - z.still
    x = adjusted(design, y, 1 / variance)
    first = Trial(x, design, y - design @ x, variance)

    def refit(rows: Index) -> Trial[F64] | None:
        # A clock measured on the excluded satellite alone has no rate any more: not observable.
        estimate = least_squares(design[rows], y[rows], 1 / variance[rows])
        if estimate is None:
            return None
        residual = y[rows] - design[rows] @ estimate.x
        return Trial(estimate.x, design[rows], residual, variance[rows])

    kept = exclusion.exclude(first, refit, sat, rules)
    if kept is None:
        return None, None
    x = kept.trial.found
    return (x[:3], x[3:]) if within(x.tolist(), FASTEST_MPS) else (None, None)
