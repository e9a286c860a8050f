"""How well measurements that agree are checked by each other: would a fault that matters have been seen?"""

from __future__ import annotations

from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.flightsw.integrity.consistency import NOTHING, Trial, chi2_limit, left_by_fit, outlier_limit
from gnss_hil.flightsw.measurement.weights import times
from gnss_hil.flightsw.records.ranges import distinct
from gnss_hil.flightsw.records.solution import Tested

TOLERATED, UNSEEN = 5.33, 1.43
"""So many sigmas of a fix (1e-7, two-sided) a fault may move it unseen; so many of them are left to noise:
then one in twenty of the worst faults moves it farther and is not seen."""


def tested(trial: Trial[Any], gain: F64, covariance: F64, sat: I64) -> Tested:
    """How well measurements that agree are checked by each other, and by what was known before, whichever of
    them is wrong, or all of a satellite alike.

    gain (k, n), covariance (k, k)   of what is published: what it moves by with each measurement
    sat (n,)   satellites of the measurements
    Source: Baarda (1968), external reliability: a fault is seen, half of the time, where it lifts a residual
    or the sum of all squares to its limit
    """
    if trial.freedom < 1:
        return Tested.UNTESTED
    limits = outlier_limit(len(trial.residual)), chi2_limit(trial.freedom) - trial.freedom
    moves: F64 = np.linalg.solve(covariance, gain).astype(np.float64, copy=False)
    left, own = left_by_fit(trial)
    n = len(sat)
    moved2, of_one = np.add.reduce(gain * moves), left[:n]
    # Of a fault of one range its own residual is the worst, and the sum of squares is that residual's.
    found = [_told(of_one, own[:n], moved2, of_one / min(limits))]
    if distinct(sat) < n:
        found.append(_of_satellites(trial, left, gain, moves, sat, limits))
    return min(found)


def _told(checked: F64, own: F64, moved2: F64, seen: F64) -> Tested:
    """Of faults (f,) of a metre: what is left of their squares, of how much; the square of what they move, in
    sigmas; and of what they are seen by, over its limit."""
    if not (checked > NOTHING * own)[moved2 > NOTHING * own].all():
        return Tested.UNTESTED
    return Tested.TESTED if (moved2 <= (TOLERATED - UNSEEN) ** 2 * seen).all() else Tested.CHECKED


def _of_satellites(
    trial: Trial[Any], left: F64, gain: F64, moves: F64, sat: I64, limits: tuple[float, float]
) -> Tested:
    """As `tested`, of faults of satellites in all their ranges, where they have more than one."""
    of_satellite = sat[:, None] == np.unique(sat)
    fault = of_satellite[:, np.add.reduce(of_satellite) > 1].astype(float)
    rows = np.concatenate((fault, np.zeros((trial.before, fault.shape[1]))))
    weighted = times(trial.weight, rows)
    along = times(trial.weight, trial.design)
    pull = weighted - along @ (trial.covariance @ (along.T @ rows))
    on_the_whole = np.add.reduce(rows * pull)
    own = np.add.reduce(rows * weighted)
    checked = left > NOTHING * (trial.weight if trial.weight.ndim == 1 else trial.weight.diagonal())
    by_one = (pull[checked] ** 2 / left[checked, None]).max(axis=0, initial=0.0)
    moved2 = np.add.reduce((gain @ fault) * (moves @ fault))
    return _told(on_the_whole, own, moved2, np.maximum(by_one / limits[0], on_the_whole / limits[1]))
