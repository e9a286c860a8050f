"""Do the measurements of an epoch agree, and if not, what is it? For ranges and range rates alike.

What fails in practice is a satellite (its clock, its ephemeris), and then on all antennas that track it, or a
receiver, and then in all that it measures. These are what is excluded: only if they can be isolated from all
others and if something is left to test the rest by; else there is no solution rather than a guess. What the
fixes before say of the craft (`estimation.prior`) is judged beside the measurements, and is never excluded:
where it stands alone against them, all of them may be of another time.

Real receivers err in ways that no model of noise has, and a bench may want their fixes all the same: `Rules`
say how much may be excluded and whether measurements that disagree still make a solution.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from functools import cache
from itertools import combinations
from math import comb, sqrt
from statistics import NormalDist
from typing import Any, Generic, TypeVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Index
from gnss_hil.flightsw.measurement.weights import times
from gnss_hil.flightsw.records.ranges import distinct
from gnss_hil.flightsw.records.solution import Tested

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
    receivers so many receivers may
    refuse    no solution from measurements that disagree; else from all that could not be excluded
    """

    exclude: int = 3
    receivers: int = 1
    refuse: bool = True


STRICT = Rules()

BEFORE = -1
"""The unit of what was known before, beside satellites and receivers by their numbers."""

OF_SATELLITES = 6
"""One of so many satellites may be excluded: where more of them are wrong, what is left agrees by chance."""

MOST_SETS = 3000
"""So many sets of units are looked at; where there are more, fewer are taken together."""


class Refusal(Enum):
    """Why measurements make no solution."""

    INCONSISTENT = "they contradict each other, and what it is cannot be told"
    AGAINST_BEFORE = "they contradict what was known before, and nothing among them stands out"


T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Trial(Generic[T]):
    """A weighted fit: what it found, and by what it is judged.

    design (n, u), residual (n,); weight the inverse of the measurements' covariance, (n, n), or (n,) its
    diagonal; covariance (u, u) of the unknowns
    before  so many of the rows, the last ones, are what was known before
    """

    found: T
    design: F64
    residual: F64
    weight: F64
    covariance: F64
    before: int = 0

    @property
    def chi_square(self) -> float:
        return float(self.residual @ times(self.weight, self.residual))

    @property
    def freedom(self) -> int:
        return self.design.shape[0] - self.design.shape[1]

    def beside(self, offset: F64, known: F64) -> Trial[T]:
        """The same fit, judged by what was known before of its first unknowns as well.

        offset (k,), known (k, k)   what was known less what was found, and its covariance
        What was found stays; residuals are those of a fit of both.
        """
        u, k = self.design.shape[1], len(offset)
        information = np.linalg.inv(known)
        of_both = np.linalg.inv(known + self.covariance[:k, :k])
        gain = self.covariance[:, :k] @ of_both
        step = gain @ offset
        residual = np.concatenate((self.residual - self.design @ step, offset - step[:k]))
        n = len(self.residual)
        weight = np.zeros((n + k, n + k))
        weight[:n, :n] = self.weight if self.weight.ndim == 2 else np.diag(self.weight)
        weight[n:, n:] = information
        design = np.concatenate((self.design, np.eye(k, u)))
        return Trial(self.found, design, residual, weight, self.covariance - gain @ self.covariance[:k], k)


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


@dataclass(frozen=True, slots=True, eq=False)
class Units:
    """What each measurement (n,) belongs to: sat, receiver (n,) numbers."""

    sat: I64
    receiver: I64


Refit = Callable[[Index], Trial[T] | None]
"""The fit of rows (k,); None where these cannot be fitted."""


def exclude(first: Trial[T], refit: Refit[T], units: Units, rules: Rules) -> Kept[T] | Refusal:
    """The fit of the measurements that agree, or why there is none.

    Satellites are excluded one by one while one can be isolated, then some together; if the rest still
    disagrees, a receiver is, and one satellite after it.

    first   the fit of all n measurements, with what was known before
    """
    every = Kept(first, np.arange(len(units.sat)), agree(first))
    if every.consistent:
        return every
    most = min(rules.exclude, max(1, len(np.unique(units.sat)) // OF_SATELLITES))
    best = _without_satellites(every, refit, units.sat, most)
    if best.consistent:
        return best
    for _ in range(rules.receivers):
        found = _without(every, refit, units.receiver, 1, several=True)
        if found is None:
            break
        rest = _without_satellites(found, refit, units.sat, min(most, 1))
        if rest.consistent:
            return rest
        every = found
    if not rules.refuse:
        return best
    alone = first.before and isolate(units.sat, first) == {BEFORE}
    return Refusal.AGAINST_BEFORE if alone else Refusal.INCONSISTENT


def _without_satellites(kept: Kept[T], refit: Refit[T], sat: I64, most: int) -> Kept[T]:
    """Without satellites that can be isolated, `most` of them: one by one, and where none stands out by
    itself, several that do together, if the rest then agrees."""
    while most and not kept.consistent:
        lesser = _without(kept, refit, sat, 1)
        if lesser is None:
            together = (_without(kept, refit, sat, size) for size in range(2, most + 1))
            return next((found for found in together if found is not None and found.consistent), kept)
        kept, most = lesser, most - 1
    return kept


def _without(kept: Kept[T], refit: Refit[T], unit: I64, size: int, several: bool = False) -> Kept[T] | None:
    """Without so many units of these, if they can be isolated and the rest be fitted."""
    suspects = isolate(unit[kept.rows], kept.trial, size, several or size > 1)
    if suspects is None or BEFORE in suspects:
        return None
    rows = kept.rows[~np.isin(unit[kept.rows], list(suspects))]
    trial = refit(rows)
    return None if trial is None else Kept(trial, rows, agree(trial))


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
    left, own = _left(trial)
    pull = times(trial.weight, trial.residual)
    tested = left > _NOTHING * own
    return bool((pull * pull <= outlier_limit(len(own)) * left)[tested].all())


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
    left, own = _left(trial)
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
    if not (checked > _NOTHING * own)[moved2 > _NOTHING * own].all():
        return Tested.UNTESTED
    return Tested.TESTED if (moved2 <= (TOLERATED - UNSEEN) ** 2 * seen).all() else Tested.CHECKED


def _left(trial: Trial[Any]) -> tuple[F64, F64]:
    """(n,) of each measurement: what the fit leaves of its weight, and that."""
    weight, along = trial.weight, times(trial.weight, trial.design)
    own = weight if weight.ndim == 1 else weight.diagonal()
    return own - np.add.reduce((along @ trial.covariance) * along, axis=1), own


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
    checked = left > _NOTHING * (trial.weight if trial.weight.ndim == 1 else trial.weight.diagonal())
    by_one = (pull[checked] ** 2 / left[checked, None]).max(axis=0, initial=0.0)
    moved2 = np.add.reduce((gain @ fault) * (moves @ fault))
    return _told(on_the_whole, own, moved2, np.maximum(by_one / limits[0], on_the_whole / limits[1]))


def isolate(unit: I64, trial: Trial[Any], size: int = 1, several: bool = False) -> frozenset[int] | None:
    """The units, so many, without which the others agree distinctly better than without any other so many;
    None if none stand out or nothing would be left to test the others by.

    unit     (n,) of the measurements fitted: satellites or receivers; what was known before is one as well
    several  faults of their own are assumed: then more must be left to test than is taken out
    With the weight W, the residuals r and Q = W - W A (A'W A)^-1 A'W, what the fit leaves of it, removing
    rows S lowers the sum of squares by (W r)_S' Q_SS^+ (W r)_S and the freedom by the rank of Q_SS: least
    squares with one bias for each of these rows.
    """
    unit = np.concatenate((unit, np.full(trial.before, BEFORE)))
    names = sorted(set(unit.tolist()))
    if size > 1 and trial.before:
        names.remove(BEFORE)  # a fault of its own: that of all measurements, not of one among several
    if len(names) <= size or comb(len(names), size) > MOST_SETS:
        return None
    weight = trial.weight if trial.weight.ndim == 2 else np.diag(trial.weight)
    scale = 1 / np.sqrt(weight.diagonal())
    along_fit = weight @ trial.design
    left = weight - along_fit @ trial.covariance @ along_fit.T
    left *= scale[:, None] * scale
    pull = (weight @ trial.residual) * scale
    rows_of = {name: np.flatnonzero(unit == name) for name in names}

    def gains() -> Iterator[tuple[float, tuple[int, ...], int]]:
        for suspects in combinations(names, size):
            rows = np.concatenate([rows_of[name] for name in suspects])
            share, axes = np.linalg.eigh(left[np.ix_(rows, rows)])
            tested = share > _NOTHING
            gain = float(((pull[rows] @ axes[:, tested]) ** 2 / share[tested]).sum())
            yield gain, suspects, int(tested.sum())

    (gain, suspects, tested), (second, *_) = sorted(gains(), reverse=True)[:2]
    checks = trial.freedom - tested >= (tested + 1 if several else 1)
    return frozenset(suspects) if gain - second > DISTINCT and checks else None
