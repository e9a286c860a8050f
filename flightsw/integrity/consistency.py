"""Do the measurements of a fit agree? Two tests of residuals: all squares together, and each by itself."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import sqrt
from statistics import NormalDist
from typing import Any, Generic, TypeVar

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.measurement.weights import times

FALSE_ALARM = 1e-5
"""Rate of false alarms of a fit: half of it for each of its two tests."""

_ALARM_SIGMA = NormalDist().inv_cdf(1 - FALSE_ALARM / 2)

NOTHING = 1e-6
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
    left, own = left_by_fit(trial)
    pull = times(trial.weight, trial.residual)
    tested = left > NOTHING * own
    return bool((pull * pull <= outlier_limit(len(own)) * left)[tested].all())


def left_by_fit(trial: Trial[Any]) -> tuple[F64, F64]:
    """(n,) of each measurement: what the fit leaves of its weight, and that."""
    weight, along = trial.weight, times(trial.weight, trial.design)
    own = weight if weight.ndim == 1 else weight.diagonal()
    return own - np.add.reduce((along @ trial.covariance) * along, axis=1), own
