"""Where the measurements of an epoch do not agree, what is it? For ranges and range rates alike.

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
from itertools import combinations
from math import comb
from statistics import NormalDist
from typing import Any, Generic, TypeVar

import numpy as np

from gnss_hil.dbc.common.arrays import I64, Index
from gnss_hil.flightsw.integrity.consistency import FALSE_ALARM, NOTHING, Trial, agree

DISTINCT = NormalDist().inv_cdf(1 - FALSE_ALARM) ** 2
"""So much more chi-square than the suspect any other satellite must leave behind. A sound satellite is then
taken for the faulty one at most once in 1e5, whatever the size of the fault: the difference of the two sums
of squares is normal with mean -d^2 and deviation 2 d, and exceeds D with probability Q((d^2 + D) / 2 d),
at worst Q(sqrt D)."""


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
            tested = share > NOTHING
            gain = float(((pull[rows] @ axes[:, tested]) ** 2 / share[tested]).sum())
            yield gain, suspects, int(tested.sum())

    (gain, suspects, tested), (second, *_) = sorted(gains(), reverse=True)[:2]
    checks = trial.freedom - tested >= (tested + 1 if several else 1)
    return frozenset(suspects) if gain - second > DISTINCT and checks else None
