"""Forces on a craft: a table of accelerations by name. A richer force is one more row.

An acceleration is a pure function of GPS time [ns] (n,), position [m] and velocity [m/s] (n, 3) in the
eci frame of `emulator.world.earth`; it returns (n, 3) [m/s^2].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from emulator.world.earth import MU_M3PS2

Array = NDArray[np.float64]
Acceleration = Callable[[NDArray[np.int64], Array, Array], Array]

REFERENCE_RADIUS_M = 6_378_136.3
"""Radius the EGM2008 coefficients refer to."""

# Fully normalised, tide-free C(n,0) of EGM2008 (Pavlis et al., J. Geophys. Res. 117, B04406, 2012;
# EGM2008_to2190_TideFree). J_n = -sqrt(2 n + 1) C(n,0).
_NORMALISED = {2: -0.484165143790815e-3, 3: 0.957161207093473e-6, 4: 0.539965866638991e-6}
ZONAL = {degree: -np.sqrt(2 * degree + 1) * value for degree, value in _NORMALISED.items()}
"""J_n by degree, unnormalised."""

# Legendre polynomials P_n(s) and their derivatives, ascending powers of s.
_LEGENDRE = {2: (-0.5, 0, 1.5), 3: (0, -1.5, 0, 2.5), 4: (0.375, 0, -3.75, 0, 4.375)}


def central(t_ns: NDArray[np.int64], pos_eci_m: Array, vel_eci_mps: Array) -> Array:
    """Attraction of a point mass."""
    r_m = np.sqrt(np.einsum("ij,ij->i", pos_eci_m, pos_eci_m))
    return pos_eci_m * (-MU_M3PS2 / r_m**3)[:, None]


def zonal(degree: int) -> Acceleration:
    """Attraction of one zonal harmonic.

    The gradient of -mu J_n R^n P_n(s) / r^(n+1), s = z / r:
    a = mu J_n R^n / r^(n+2) [((n + 1) P_n + s P_n') r_hat - P_n' z_hat].
    Source: Montenbruck & Gill, Satellite Orbits, 3.2 (potential 3.26 with m = 0)
    """
    scale = MU_M3PS2 * ZONAL[degree] * REFERENCE_RADIUS_M**degree
    value = np.polynomial.Polynomial(_LEGENDRE[degree])
    radial = (degree + 1) * value + np.polynomial.Polynomial((0, 1)) * value.deriv()
    powers = np.arange(degree + 1)
    # One product of powers of s gives both brackets.
    brackets = np.zeros((degree + 1, 2))
    brackets[:, 0] = radial.coef
    brackets[:degree, 1] = value.deriv().coef

    def acceleration(t_ns, pos_eci_m, vel_eci_mps):
        r_m = np.sqrt(np.einsum("ij,ij->i", pos_eci_m, pos_eci_m))
        s = pos_eci_m[:, 2] / r_m
        factors = (s[:, None] ** powers) @ brackets * (scale / r_m ** (degree + 2))[:, None]
        out = pos_eci_m * (factors[:, 0] / r_m)[:, None]
        out[:, 2] -= factors[:, 1]
        return out

    return acceleration


FORCES: dict[str, Acceleration] = {f"j{degree}": zonal(degree) for degree in sorted(ZONAL)}
"""Forces a scenario may name beside the central attraction."""


def total(names: Sequence[str]) -> Acceleration:
    """The sum of the central attraction and the named forces."""
    parts = (central, *(FORCES[name] for name in names))

    def acceleration(t_ns, pos_eci_m, vel_eci_mps):
        return sum(part(t_ns, pos_eci_m, vel_eci_mps) for part in parts)

    return acceleration
