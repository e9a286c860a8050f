"""Do the measurements of an epoch agree, and if not, which satellite is it? For ranges and range rates alike.

What fails in practice is a satellite (its clock, its ephemeris), and then on all antennas that track it: a
satellite is the unit of exclusion. It is excluded only if it is told apart from all others and if something
is left to test the rest by; else there is no solution rather than a guess.
"""

from __future__ import annotations

from functools import cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

FALSE_ALARM_SIGMA = 4.265
"""Normal quantile of a false alarm rate of 1e-5 of the test."""

DISTINCT = FALSE_ALARM_SIGMA**2
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
    return freedom * (1 - spread + FALSE_ALARM_SIGMA * sqrt(spread)) ** 3


def agree(residual: NDArray[np.float64], variance: NDArray[np.float64], unknowns: int) -> bool:
    """Whether residuals (n,) of a fit of so many unknowns are noise. Without redundancy they always are."""
    freedom = len(residual) - unknowns
    return freedom < 1 or float(residual @ (residual / variance)) <= chi2_limit(freedom)


def culprit(
    sat: NDArray[np.int64],
    design: NDArray[np.float64],
    residual: NDArray[np.float64],
    variance: NDArray[np.float64],
) -> int | None:
    """The satellite without which the others agree distinctly better than without any other; None if none
    stands out or nothing would be left to test the others by.

    sat (n,), design (n, u), residual (n,) of the weighted fit, variance (n,). With the whitened residuals w
    and the projector P on the space they can occupy, removing rows S lowers the sum of squares by
    w_S' P_SS^+ w_S and the freedom by the rank of P_SS: least squares with one bias for each of these rows.
    """
    scale = 1 / np.sqrt(variance)
    basis, _ = np.linalg.qr(design * scale[:, None])
    project = np.eye(len(sat)) - basis @ basis.T
    white = residual * scale
    found = []
    for suspect in sorted(set(sat.tolist())):
        rows = np.flatnonzero(sat == suspect)
        share, along = np.linalg.eigh(project[np.ix_(rows, rows)])
        tested = share > _NOTHING
        gain = float(((white[rows] @ along[:, tested]) ** 2 / share[tested]).sum())
        found.append((gain, suspect, int(tested.sum())))
    (gain, suspect, tested), (second, *_) = sorted(found, reverse=True)[:2]
    freedom = len(sat) - design.shape[1]
    return suspect if gain - second > DISTINCT and freedom - tested >= 1 else None
