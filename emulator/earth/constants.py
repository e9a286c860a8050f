"""The Earth as truth: constants, rotation, gravity field's first zonals.

Frames. `ecef` is WGS-84 Earth-centred, Earth-fixed. `eci` shares its z axis and is turned about it by
the Earth rotation angle: the true equator of date without polar motion, precession or nutation, which
is enough where no inertial coordinate ever leaves the emulator. UT1 - UTC is taken as zero: measured
orientation is for files in celestial axes (`frames`), not for orbits that begin in this eci.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64

LIGHT_MPS = 299_792_458.0
"""Speed of light. IS-GPS-200, 20.3.3.3.3.1."""

ROTATION_RPS = 7.2921151467e-5
"""WGS-84 rotation rate of the Earth. IS-GPS-200, table 20-IV."""

MU_M3PS2 = 3.986004418e14
"""Gravitational parameter of the Earth, WGS-84 (NGA.STND.0036, table 3.1)."""

EQUATORIAL_RADIUS_M = 6_378_137.0
"""Semi-major axis of the WGS-84 ellipsoid (NGA.STND.0036, table 3.1)."""

FLATTENING = 1 / 298.257223563
"""Of that ellipsoid (the same table)."""

POLAR_RADIUS_M = EQUATORIAL_RADIUS_M * (1 - FLATTENING)

ECCENTRICITY2 = FLATTENING * (2 - FLATTENING)
"""Square of that ellipsoid's first eccentricity."""

_DAY_NS = 86_400_000_000_000
_J2000_NS = 7300 * _DAY_NS + _DAY_NS // 2
"""2000-01-01 12:00 counted from 1980-01-06 00:00 on one uniform calendar."""


def rotation_angle_rad(t_ns: int | I64, leap_s: int) -> F64:
    """Earth rotation angle at GPS time t_ns, ecef relative to eci.

    t_ns     (...,) GPS time [ns]
    leap_s   GPS - UTC [s]. A run keeps the value of its start: the Earth does not jump with UTC
    returns  (...,) angle [rad], 0 to 2 pi
    Source: IERS Conventions (2010), eq. 5.15
    """
    days, rest_ns = np.divmod(np.asarray(t_ns, np.int64) - (leap_s * 1_000_000_000 + _J2000_NS), _DAY_NS)
    fraction = rest_ns / _DAY_NS
    turns = 0.7790572732640 + 0.00273781191135448 * (days + fraction) + fraction
    return 2 * np.pi * (turns % 1.0)


def eci_to_ecef(pos_eci_m: F64, angle_rad: F64) -> F64:
    """Coordinates (..., 3) turned about z from eci to ecef by the Earth rotation angle (...,) [rad]."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z = pos_eci_m[..., 0], pos_eci_m[..., 1], pos_eci_m[..., 2]
    return np.stack((cos * x + sin * y, cos * y - sin * x, z), axis=-1)


def sidereal_angle_rad(t_ns: int, leap_s: int) -> float:
    """Greenwich mean sidereal time [rad], the older angle from the mean equinox of date, at GPS time t_ns.

    Source: IAU 1982 (Aoki et al., Astron. Astrophys. 105, 1982), as in the Explanatory Supplement, 2.24
    """
    centuries = (t_ns - leap_s * 1_000_000_000 - _J2000_NS) / _DAY_NS / 36525
    seconds = 67310.54841 + centuries * (
        876600 * 3600 + 8640184.812866 + centuries * (0.093104 - 6.2e-6 * centuries)
    )
    return seconds % 86400 / 86400 * 2 * np.pi
