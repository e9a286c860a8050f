"""Forces on a craft: tables of accelerations by name. A richer force is one more row.

All coordinates are in the eci frame of the run: the celestial intermediate frame of its start, held fixed, in
which the Earth turns about z by the Earth rotation angle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.config import tables as scenario
from gnss_hil.emulator.earth.atmosphere import density_kgpm3
from gnss_hil.emulator.earth.constants import MU_M3PS2, ROTATION_RPS, eci_to_ecef, rotation_angle_rad
from gnss_hil.emulator.earth.gravity import REFERENCE_RADIUS_M, field
from gnss_hil.emulator.earth.sun_moon import MU_MOON_M3PS2, MU_SUN_M3PS2, InertialBodies
from gnss_hil.emulator.orbits.radiation import pressure_npm2

Acceleration = Callable[[I64, F64, F64], F64]
"""Of GPS times (n,) [ns], positions (n, 3) [m] and velocities (n, 3) [m/s]: (n, 3) [m/s^2]."""

# Fully normalised, tide-free C(n,0) of EGM2008, as in egm2008.csv. J_n = -sqrt(2 n + 1) C(n,0).
_NORMALISED = {2: -0.484165143790815e-3, 3: 0.957161207093473e-6, 4: 0.539965866638991e-6}
ZONAL = {degree: -np.sqrt(2 * degree + 1) * value for degree, value in _NORMALISED.items()}
"""J_n by degree, unnormalised."""

# Legendre polynomials P_n(s) and their derivatives, ascending powers of s.
_LEGENDRE = {2: (-0.5, 0, 1.5), 3: (0, -1.5, 0, 2.5), 4: (0.375, 0, -3.75, 0, 4.375)}


def central(t_ns: I64, pos_eci_m: F64, vel_eci_mps: F64) -> F64:
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


ZONALS: dict[str, Acceleration] = {f"j{degree}": zonal(degree) for degree in sorted(ZONAL)}
"""Forces that need neither time nor a craft's properties."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What the world is like at n instants.

    angle_rad   (n,) Earth rotation angle
    sun_eci_m   (n, 3) the Sun
    moon_eci_m  (n, 3) the Moon
    """

    angle_rad: F64
    sun_eci_m: F64
    moon_eci_m: F64


Force = Callable[[Moment, F64, F64], F64]
"""An acceleration from the state of the world instead of the time."""


def geopotential(degree: int) -> Force:
    """Attraction of all harmonics of EGM2008 of degree 2 to `degree`."""
    by_harmonics = field(degree)

    def acceleration(moment, pos_eci_m, vel_eci_mps):
        acc_ecef = by_harmonics(eci_to_ecef(pos_eci_m, moment.angle_rad))
        return eci_to_ecef(acc_ecef, -moment.angle_rad)

    return acceleration


def third_body(mu_m3ps2: float, pos_eci_m: F64, body_eci_m: F64) -> F64:
    """Attraction of a distant point mass on positions (n, 3), relative to its attraction of the Earth.

    Source: Montenbruck & Gill, eq. 3.37
    """
    away_m = body_eci_m - pos_eci_m
    near = away_m / np.linalg.norm(away_m, axis=1)[:, None] ** 3
    return mu_m3ps2 * (near - body_eci_m / np.linalg.norm(body_eci_m, axis=1)[:, None] ** 3)


def _drag(given: scenario.Orbit) -> Force:
    """Drag of air that turns with the Earth. Source: Montenbruck & Gill, eqs. 3.97 and 3.98"""
    ballistic_m2pkg = given.drag_coefficient * given.drag_area_m2 / given.mass_kg

    def acceleration(moment, pos_eci_m, vel_eci_mps):
        through_air = vel_eci_mps.copy()
        through_air[:, 0] += ROTATION_RPS * pos_eci_m[:, 1]
        through_air[:, 1] -= ROTATION_RPS * pos_eci_m[:, 0]
        density = density_kgpm3(pos_eci_m, moment.sun_eci_m, given.bulge_exponent)
        speed = np.linalg.norm(through_air, axis=1)
        return through_air * (-0.5 * ballistic_m2pkg * density * speed)[:, None]

    return acceleration


def _radiation(given: scenario.Orbit) -> Force:
    """Pressure of sunlight on a ball. Source: Montenbruck & Gill, eq. 3.76"""
    area_m2pkg = given.radiation_coefficient * given.radiation_area_m2 / given.mass_kg
    return lambda moment, pos_eci_m, vel_eci_mps: area_m2pkg * pressure_npm2(pos_eci_m, moment.sun_eci_m)


FORCES: dict[str, Callable[[scenario.Orbit], Force]] = {
    "egm2008": lambda given: geopotential(given.degree),
    "sun": lambda given: lambda moment, pos, vel: third_body(MU_SUN_M3PS2, pos, moment.sun_eci_m),
    "moon": lambda given: lambda moment, pos, vel: third_body(MU_MOON_M3PS2, pos, moment.moon_eci_m),
    "drag": _drag,
    "radiation": _radiation,
}
"""Forces that depend on the moment or the craft."""


def zonals(names: Sequence[str]) -> Acceleration:
    """The sum of the central attraction and the named rows of ZONALS."""
    parts = [ZONALS[name] for name in names]

    def acceleration(t_ns, pos_eci_m, vel_eci_mps):
        acc = central(t_ns, pos_eci_m, vel_eci_mps)
        for part in parts:
            acc = acc + part(t_ns, pos_eci_m, vel_eci_mps)
        return acc

    return acceleration


def total(given: scenario.Orbit, start_ns: int) -> Acceleration:
    """The sum of the central attraction and the forces an orbit names, in a run from GPS time start_ns on."""
    without_time = zonals([name for name in given.forces if name in ZONALS])
    parts = [FORCES[name](given) for name in given.forces if name in FORCES]
    if not parts:
        return without_time
    leap_s, bodies = gpstime.leap_seconds(start_ns), InertialBodies(start_ns)

    def acceleration(t_ns, pos_eci_m, vel_eci_mps):
        moment = Moment(rotation_angle_rad(t_ns, leap_s), *bodies.at(t_ns))
        acc = without_time(t_ns, pos_eci_m, vel_eci_mps)
        for part in parts:
            acc += part(moment, pos_eci_m, vel_eci_mps)
        return acc

    return acceleration
