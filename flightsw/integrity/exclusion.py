"""Do the measurements of an epoch agree, and if not, which satellite is it? For ranges and range rates alike.

What fails in practice is a satellite (its clock, its ephemeris), and then on all antennas that track it: a
satellite is the unit of exclusion. It is excluded only if it can be isolated from all others and if something
is left to test the rest by; else there is no solution rather than a guess.

Real receivers err in ways that no model of noise has, and a bench may want their fixes all the same: `Rules`
say how many satellites may be excluded and whether measurements that disagree still make a solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import sqrt
from statistics import NormalDist
from typing import Any, Generic, TypeVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Index
from gnss_hil.flightsw.measurement.weights import times

FALSE_ALARM = 1e-5
"""Rate of false alarms of a fit: half of it for each of its two tests."""

_ALARM_SIGMA = NormalDist().inv_cdf(1 - FALSE_ALARM / 2)

DISTINCT = NormalDist().inv_cdf(1 - FALSE_ALARM) ** 2
"""So much more chi-square than the suspect any other satellite must leave behind. A sound satellite is then
taken for the faulty one at most once in 1e5, whatever the size of the fault: the difference of the two sums
of squares is normal with mean -d^2 and deviation 2 d, and exceeds D with probability Q((d^2 + D) / 2 d),
at worst Q(sqrt D)."""

_NOTHING = 1e-6
"""Share of a measurement in its own residual below which it is not tested at all."""


@cache
def chi2_limit(freedom: int) -> float:
    """Quantile of chi-square at the false alarm rate. Source: Wilson & Hilferty, PNAS 17 (1931) 684"""
    spread = 2 / (9 * freedom)
    return freedom * (1 - spread + _ALARM_SIGMA * sqrt(spread)) ** 3


@cache
def outlier_limit(tests: int) -> float:
    """Square that the largest of so many normalised residuals exceeds at the false alarm rate."""
    return NormalDist().inv_cdf(1 - FALSE_ALARM / 2 / (2 * tests)) ** 2


@dataclass(frozen=True, slots=True)
class Rules:
    """exclude   so many satellites may be excluded from an epoch's ranges, and from its range rates
    refuse    no solution from measurements that disagree; else from all that could not be excluded
    """

    exclude: int = 1
    refuse: bool = True


STRICT = Rules()

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Trial(Generic[T]):
    """A weighted fit: what it found, and by what it is judged.

    design (n, u), residual (n,); weight the inverse of the measurements' covariance, (n, n), or (n,) its
    diagonal; covariance (u, u) of the unknowns
    """

    found: T
    design: F64
    residual: F64
    weight: F64
    covariance: F64

    @property
    def chi_square(self) -> float:
        return float(self.residual @ times(self.weight, self.residual))

    @property
    def freedom(self) -> int:
        return self.design.shape[0] - self.design.shape[1]


@dataclass(frozen=True, slots=True, eq=False)
class Kept(Generic[T]):
    """A fit of the rows (k,) that are left, and whether these agree."""

    trial: Trial[T]
    rows: Index
    consistent: bool

    @property
    def misfit(self) -> float:
        """Chi-square for each degree of freedom where the fit is one of rows that disagree; else 1. Many that
        agree well may hide one that does not: no fit of rows that disagree is better than one of rows that
        agree."""
        return 1.0 if self.consistent else max(self.trial.chi_square / self.trial.freedom, 1.0)


def exclude(
    first: Trial[T], refit: Callable[[Index], Trial[T] | None], sat: I64, rules: Rules
) -> Kept[T] | None:
    """The fit of the measurements that agree, or None if what is left disagrees and is refused. Satellites
    are excluded one by one while one can be isolated.

    first   the fit of all n measurements
    refit   of rows (k,); None where these cannot be fitted
    sat     (n,) satellite of each row
    """
    kept = Kept(first, np.arange(len(sat)), agree(first))
    for _ in range(rules.exclude):
        if kept.consistent:
            break
        suspect = isolate(sat[kept.rows], kept.trial)
        if suspect is None:
            break
        rows = kept.rows[sat[kept.rows] != suspect]
        trial = refit(rows)
        if trial is None:
            break
        kept = Kept(trial, rows, agree(trial))
    return kept if kept.consistent or not rules.refuse else None


def agree(trial: Trial[Any]) -> bool:
    """Whether what was measured agrees: on the whole, and each by itself. Without redundancy it does."""
    return trial.freedom < 1 or (chi_square_test(trial) and outlier_test(trial))


def chi_square_test(trial: Trial[Any]) -> bool:
    """Whether the residuals of a fit, with a freedom of at least 1, are noise."""
    return trial.chi_square <= chi2_limit(trial.freedom)


def outlier_test(trial: Trial[Any]) -> bool:
    """Whether no measurement is off by more than noise makes the worst of them. A single fault that drowns in
    the sum of all squares stands out here. Source: Baarda, A testing procedure for use in geodetic networks
    (1968): normalised residuals
    """
    weight, along = trial.weight, times(trial.weight, trial.design)
    own = weight if weight.ndim == 1 else weight.diagonal()
    left = own - np.add.reduce((along @ trial.covariance) * along, axis=1)
    pull = times(weight, trial.residual)
    tested = left > _NOTHING * own
    return bool((pull * pull <= outlier_limit(len(own)) * left)[tested].all())


def isolate(sat: I64, trial: Trial[Any]) -> int | None:
    """The satellite without which the others agree distinctly better than without any other; None if none
    stands out or nothing would be left to test the others by.

    sat   (n,) of the rows fitted. With the weight W, the residuals r and Q = W - W A (A'W A)^-1 A'W, what
    the fit leaves of it, removing rows S lowers the sum of squares by (W r)_S' Q_SS^+ (W r)_S and the freedom
    by the rank of Q_SS: least squares with one bias for each of these rows.
    """
    weight = trial.weight if trial.weight.ndim == 2 else np.diag(trial.weight)
    scale = 1 / np.sqrt(weight.diagonal())
    along_fit = weight @ trial.design
    left = weight - along_fit @ trial.covariance @ along_fit.T
    left *= scale[:, None] * scale
    pull = (weight @ trial.residual) * scale
    found = []
    for suspect in sorted(set(sat.tolist())):
        rows = np.flatnonzero(sat == suspect)
        share, axes = np.linalg.eigh(left[np.ix_(rows, rows)])
        tested = share > _NOTHING
        gain = float(((pull[rows] @ axes[:, tested]) ** 2 / share[tested]).sum())
        found.append((gain, suspect, int(tested.sum())))
    (gain, suspect, tested), (second, *_) = sorted(found, reverse=True)[:2]
    return suspect if gain - second > DISTINCT and trial.freedom - tested >= 1 else None
