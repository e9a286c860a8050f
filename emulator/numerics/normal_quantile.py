"""The inverse of the standard normal distribution function, to the precision of the numbers.

Source: S. L. Moshier, Cephes 2.8, ndtri.c: rational functions of p - 1/2 in the middle, and of
1 / sqrt(-2 ln p) in the tails. SciPy's `ndtri` is the same; a process that needs no more of SciPy starts
without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

import numpy as np

from gnss_hil.dbc.common.arrays import F64

TAIL = exp(-2)
"""Probability at which a tail begins."""

_ROOT_TWO_PI = 2.50662827463100050242
"""As Cephes has it; the rounded root of the rounded number is a unit of the last place less."""

_FAR = 8.0
"""sqrt(-2 ln p) from which a tail is far."""

_Rational = tuple[tuple[float, ...], tuple[float, ...]]
"""Numerator and denominator, highest power first."""

_MIDDLE: _Rational = (
    (
        -5.99633501014107895267e1,
        9.80010754185999661536e1,
        -5.66762857469070293439e1,
        1.39312609387279679503e1,
        -1.23916583867381258016e0,
    ),
    (
        1.0,
        1.95448858338141759834e0,
        4.67627912898881538453e0,
        8.63602421390890590575e1,
        -2.25462687854119370527e2,
        2.00260212380060660359e2,
        -8.20372256168333339912e1,
        1.59056225126211695515e1,
        -1.18331621121330003142e0,
    ),
)

_NEAR_TAIL: _Rational = (
    (
        4.05544892305962419923e0,
        3.15251094599893866154e1,
        5.71628192246421288162e1,
        4.40805073893200834700e1,
        1.46849561928858024014e1,
        2.18663306850790267539e0,
        -1.40256079171354495875e-1,
        -3.50424626827848203418e-2,
        -8.57456785154685413611e-4,
    ),
    (
        1.0,
        1.57799883256466749731e1,
        4.53907635128879210584e1,
        4.13172038254672030440e1,
        1.50425385692907503408e1,
        2.50464946208309415979e0,
        -1.42182922854787788574e-1,
        -3.80806407691578277194e-2,
        -9.33259480895457427372e-4,
    ),
)

_FAR_TAIL: _Rational = (
    (
        3.23774891776946035970e0,
        6.91522889068984211695e0,
        3.93881025292474443415e0,
        1.33303460815807542389e0,
        2.01485389549179081538e-1,
        1.23716634817820021358e-2,
        3.01581553508235416007e-4,
        2.65806974686737550832e-6,
        6.23974539184983293730e-9,
    ),
    (
        1.0,
        6.02427039364742014255e0,
        3.67983563856160859403e0,
        1.37702099489081330271e0,
        2.16236993594496635890e-1,
        1.34204006088543189037e-2,
        3.28014464682127739104e-4,
        2.89247864745380683936e-6,
        6.79019408009981274425e-9,
    ),
)


def normal_quantile(probability: F64) -> F64:
    """The number (...) that a standard normal variable stays below with a probability (...) in (0, 1)."""
    p = np.asarray(probability, np.float64)
    upper = p > 1 - TAIL
    lower = np.where(upper, 1 - p, p)  # of the two tails the one that is asked for, mirrored
    middle = lower > TAIL
    out = np.empty_like(p)
    out[middle] = _middle(lower[middle])
    tail = ~middle
    size = _tail(lower[tail])
    out[tail] = np.where(upper[tail], size, -size)
    return out


def _middle(p: F64) -> F64:
    off = p - 0.5
    square = off * off
    return (off + off * _times_ratio(_MIDDLE, square)) * _ROOT_TWO_PI


def _tail(p: F64) -> F64:
    """The distance from zero of tails of probability p."""
    x = np.sqrt(-2 * np.log(p))
    inverse = 1 / x
    correction = _times_ratio(_NEAR_TAIL, inverse)
    far = x >= _FAR
    if far.any():
        correction[far] = _times_ratio(_FAR_TAIL, inverse[far])
    return x - np.log(x) / x - correction


def _times_ratio(rational: _Rational, x: F64) -> F64:
    """x times a rational function of it, rounded in the order of the source."""
    above, below = rational
    return x * _polynomial(above, x) / _polynomial(below, x)


def _polynomial(coefficients: Sequence[float], x: F64) -> F64:
    """By Horner's rule."""
    total = np.full_like(x, coefficients[0])
    for coefficient in coefficients[1:]:
        total = total * x + coefficient
    return total
