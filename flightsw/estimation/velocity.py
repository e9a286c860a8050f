"""Velocity of the centre of mass and rates of the clocks, from the range rates of a fix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Index
from gnss_hil.flightsw.estimation.least_squares import Estimate, least_squares, scattered
from gnss_hil.flightsw.estimation.prior import Prior
from gnss_hil.flightsw.integrity import exclusion
from gnss_hil.flightsw.integrity.consistency import Trial
from gnss_hil.flightsw.integrity.exclusion import Refusal, Rules, Units
from gnss_hil.flightsw.measurement.range_rate import RangeRates
from gnss_hil.flightsw.measurement.weights import weight
from gnss_hil.flightsw.records.solution import FASTEST_MPS, within


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """velocity_mps (3,), drift_mps (c,) of the clocks, and the covariance (3 + c, 3 + c) of both.

    gain     (3, n) what a metre a second of each range rate moves the velocity, zero where not used
    misfit   chi-square for each degree of freedom where range rates that disagree made it; else 1. It is in
             the covariance
    """

    velocity_mps: F64
    drift_mps: F64
    covariance: F64
    gain: F64
    misfit: float


def motion(z: RangeRates, units: Units, rules: Rules, prior: Prior | None = None) -> Motion | None:
    """Velocity and clock rates, after the exclusion of satellites that contradict the others.

    None if the range rates contradict each other or the bus cannot carry what they give.

    z     along rays of a position that these measurements made observable
    units what each belongs to
    prior what the fixes before say
    """
    design, y = z.design, z.value - z.still
    own, common = z.errors()

    def fit(rows: Index | slice) -> Trial[Estimate] | None:
        # A clock measured on an excluded satellite alone has no rate any more: not observable.
        of_rows, weights = design[rows], weight(own[rows], common[rows])
        found = least_squares(of_rows, y[rows], weights)
        if found is None:
            return None
        trial = Trial(found, of_rows, y[rows] - of_rows @ found.x, weights, found.covariance)
        if prior is None:
            return trial
        return trial.beside(prior.velocity_mps - found.x[:3], prior.velocity_covariance_m2ps2)

    first = fit(slice(None))
    kept = None if first is None else exclusion.exclude(first, fit, units, rules)
    if kept is None or isinstance(kept, Refusal):
        return None
    found = kept.trial.found
    if not within(found.x.tolist(), FASTEST_MPS):
        return None
    gain = scattered(found.gain[:3], kept.rows, len(units.sat), 0.0)
    return Motion(found.x[:3], found.x[3:], found.covariance * kept.misfit, gain, kept.misfit)


def rough_velocity(z: RangeRates) -> F64:
    """(3,) of all range rates as they are: good enough to see how rays sweep the ionosphere."""
    found = least_squares(z.design, z.value - z.still, 1 / z.variance)
    return np.zeros(3) if found is None else found.x[:3]
