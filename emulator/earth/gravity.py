"""The Earth's gravity beyond the point mass: EGM2008 to any degree up to 50.

The solid harmonics obey recursions that hold for all orders at once, so a set of points costs one pass over
the degrees; the acceleration is then one product of the harmonics with a matrix of the coefficients.
Source: Montenbruck & Gill, Satellite Orbits, 3.2.4 and 3.2.5 (Cunningham); fully normalised as in Fantino &
Casotto, J. Geodesy 83, 2009.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import resources
from itertools import islice
from math import factorial

import numpy as np

from gnss_hil.dbc.common.arrays import C128, F64
from gnss_hil.emulator.earth.constants import MU_M3PS2

REFERENCE_RADIUS_M = 6_378_136.3
"""Radius the EGM2008 coefficients refer to."""

HIGHEST_DEGREE = 50
"""Degree and order up to which the coefficients ship."""


def coefficients(degree: int) -> tuple[F64, F64]:
    """C(n,m) and S(n,m) of EGM2008, fully normalised, tide-free, (degree + 1, degree + 1) each.

    Degrees 0 and 1 are zero: the point mass is a force of its own, and the origin is the centre of mass.
    Source: Pavlis et al., J. Geophys. Res. 117, B04406, 2012 (EGM2008_to2190_TideFree)
    """
    text = (resources.files("gnss_hil.emulator.data") / "egm2008.csv").read_text("ascii")
    lines = (line for line in text.splitlines() if not line.startswith("#"))
    rows = np.loadtxt(islice(lines, (degree + 1) * (degree + 2) // 2 - 3), delimiter=",")
    n, m = rows[:, :2].astype(int).T
    c, s = np.zeros((2, degree + 1, degree + 1))
    c[n, m], s[n, m] = rows[:, 2:].T
    return c, s


def _norm(n: int, m: int) -> float:
    """Fully normalised harmonic over the plain one; zero where there is none."""
    if not 0 <= m <= n:
        return 0.0
    # A quotient of integers: exact, however large they are.
    return ((1 if m == 0 else 2) * (2 * n + 1) * factorial(n - m) / factorial(n + m)) ** 0.5


def _gradient(c: F64, s: F64) -> F64:
    """Matrix (3, 2, n + 1, m + 1) from harmonics one degree higher to the acceleration, in units of mu / R^2.

    The second axis is the real part (V) and the imaginary one (W).
    Source: Montenbruck & Gill, eqs. 3.32 and 3.33
    """
    degree = len(c) - 1
    out = np.zeros((3, 2, degree + 2, degree + 2))
    for n in range(2, degree + 1):
        for m in range(n + 1):
            plain = _norm(n, m)
            cv, sv = plain * c[n, m], plain * s[n, m]
            up, same = 1 / _norm(n + 1, m + 1), 1 / _norm(n + 1, m)
            row = out[:, :, n + 1]
            row[2, 0, m] -= (n - m + 1) * same * cv
            row[2, 1, m] -= (n - m + 1) * same * sv
            half = 1.0 if m == 0 else 0.5
            row[0, :, m + 1] -= half * up * np.array((cv, sv))
            row[1, :, m + 1] -= half * up * np.array((-sv, cv))
            if m > 0:
                down = 0.5 * (n - m + 2) * (n - m + 1) / _norm(n + 1, m - 1)
                row[0, :, m - 1] += down * np.array((cv, sv))
                row[1, :, m - 1] += down * np.array((sv, -cv))
    return out


def field(degree: int) -> Callable[[F64], F64]:
    """Acceleration by the harmonics of degree 2 to `degree`, all orders.

    returns  function of positions (k, 3) ecef [m] that gives (k, 3) ecef [m/s^2]
    """
    size = degree + 2
    scale = MU_M3PS2 / REFERENCE_RADIUS_M**2
    gradient = scale * _gradient(*coefficients(degree)).reshape(3, 2 * size * size)
    along, back, diagonal = _recursion(size)

    def acceleration(pos_ecef_m: F64) -> F64:
        points = len(pos_ecef_m)
        ratio = REFERENCE_RADIUS_M / np.einsum("ij,ij->i", pos_ecef_m, pos_ecef_m)
        square = REFERENCE_RADIUS_M * ratio
        # Each harmonic is a real factor q(n,m) times (x + iy)^m (R / r^2)^m R / r.
        q = np.zeros((size, size, points))
        q[0, 0] = diagonal[0]
        q[1, :2] = along[1, 0] * pos_ecef_m[:, 2] * ratio, np.full(points, diagonal[1])
        by_z, by_square = along * (pos_ecef_m[:, 2] * ratio), back * square
        for n in range(2, size):
            np.multiply(by_z[n], q[n - 1], out=q[n])
            q[n] -= by_square[n] * q[n - 2]
            q[n, n] = diagonal[n]
        turn: C128 = np.empty((size, points), np.complex128)
        turn[0] = np.sqrt(square)
        turn[1:] = (pos_ecef_m[:, 0] + 1j * pos_ecef_m[:, 1]) * ratio
        np.cumprod(turn, axis=0, out=turn)
        harmonics = np.stack((q * turn.real, q * turn.imag)).reshape(-1, points)
        return (gradient @ harmonics).T

    return acceleration


def _recursion(size: int) -> tuple[F64, F64, F64]:
    """Factors along a column of one order, (n, m, 1) for z and for the square of the radius, and the
    harmonics (n,) where m = n, of degrees below `size`; zero where there are none.

    Source: Montenbruck & Gill, eqs. 3.29 and 3.30, normalised
    """
    along, back = np.zeros((2, size, size, 1))
    for n in range(1, size):
        m = np.arange(n)
        along[n, :n, 0] = np.sqrt((2 * n + 1) * (2 * n - 1) / ((n - m) * (n + m)))
        m = np.arange(n - 1)
        back[n, : n - 1, 0] = np.sqrt(
            (2 * n + 1) * (n + m - 1) * (n - m - 1) / ((2 * n - 3) * (n + m) * (n - m))
        )
    order = np.arange(2.0, size)
    steps = np.concatenate(([1.0, np.sqrt(3)], np.sqrt((2 * order + 1) / (2 * order))))
    return along, back, np.asarray(np.cumprod(steps), np.float64)
