"""Position and velocity between fixes: two bodies and J2 in the rotating Greenwich frame.

It starts the next fix and points the antennas while there is none; it never is a fix. Plain floats: three
numbers are no array's work.
"""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.flightsw.orbit.earth import EQUATOR_M, J2, MU_M3_S2, ROTATION_RPS

Six = tuple[float, ...]
"""Position and velocity."""

MAX_STEP_S = 30.0
"""Fourth order at 30 s is 5 cm off after ten minutes in a low orbit: less than the forces left out."""

_BULGE_M2 = 1.5 * J2 * EQUATOR_M * EQUATOR_M
_CENTRIFUGAL = ROTATION_RPS * ROTATION_RPS
"""[1/s^2]"""
_CORIOLIS_RPS = 2 * ROTATION_RPS


def acceleration(x: float, y: float, z: float, vx: float, vy: float) -> tuple[float, float, float]:
    """[m/s^2] in ECEF. Source: Montenbruck & Gill, Satellite Orbits, 3.2 (J2), 5.2 (rotating frame)"""
    r2 = x * x + y * y + z * z
    pull = -MU_M3_S2 / (r2 * sqrt(r2))
    bulge = _BULGE_M2 / r2
    polar = 5 * z * z / r2
    sideways = pull * (1 + bulge * (1 - polar))
    return (
        sideways * x + _CENTRIFUGAL * x + _CORIOLIS_RPS * vy,
        sideways * y + _CENTRIFUGAL * y - _CORIOLIS_RPS * vx,
        pull * (1 + bulge * (3 - polar)) * z,
    )


def _rate(s: Six) -> Six:
    x, y, z, vx, vy, vz = s
    return vx, vy, vz, *acceleration(x, y, z, vx, vy)


def _moved(s: Six, k: Six, h: float) -> Six:
    x, y, z, vx, vy, vz = s
    dx, dy, dz, ax, ay, az = k
    return x + h * dx, y + h * dy, z + h * dz, vx + h * ax, vy + h * ay, vz + h * az


def propagate(position_m: F64, velocity_mps: F64, dt_s: float) -> tuple[F64, F64]:
    """Position and velocity (3,), Greenwich frame, dt_s later; classical Runge-Kutta of fourth order."""
    steps = max(1, ceil(abs(dt_s) / MAX_STEP_S))
    h = dt_s / steps
    s = (*position_m.tolist(), *velocity_mps.tolist())
    for _ in range(steps):
        k1 = _rate(s)
        k2 = _rate(_moved(s, k1, h / 2))
        k3 = _rate(_moved(s, k2, h / 2))
        k4 = _rate(_moved(s, k3, h))
        s = _moved(s, tuple([a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]), h / 6)
    return np.array(s[:3]), np.array(s[3:])
