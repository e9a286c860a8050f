"""Celestial and terrestrial frames: matrices and states, vectorised over time.

gcrs   geocentric celestial reference system; EME2000 differs from it by a fixed 23 mas
cirs   celestial intermediate frame of date: z is the pole, x the intermediate origin (IAU 2006/2000B)
teme   true equator of date, mean equinox: what two-line elements propagate in
ecef   WGS-84 = ITRS. Without measured orientation the pole is the intermediate pole and UT1 is UTC

Source: IERS Conventions (2010), chapter 5; the series are those of ERFA (SOFA).
"""

from __future__ import annotations

import erfa
import numpy as np
from numpy.typing import NDArray

from dbc import gpstime

Array = NDArray[np.float64]
Times = NDArray[np.int64]

_DAY_NS = 86_400_000_000_000
_GPS_EPOCH_JD = 2_444_244.5
_TT_MINUS_GPS_DAYS = 51.184 / 86400
"""TT - TAI = 32.184 s, TAI - GPS = 19 s."""


def tt_jd(t_ns: int | Times) -> tuple[Array, Array]:
    """Julian date (TT) of GPS time t_ns (...,) [ns], in two parts: whole days, and the rest."""
    days, rest_ns = np.divmod(np.asarray(t_ns, np.int64), _DAY_NS)
    return _GPS_EPOCH_JD + days, rest_ns / _DAY_NS + _TT_MINUS_GPS_DAYS


def cirs_from_gcrs(t_ns: int | Times) -> Array:
    """Rotations (..., 3, 3) to the celestial intermediate frame of date, to 1 mas (IAU 2000B nutation)."""
    return erfa.c2i00b(*tt_jd(t_ns))


def eci_from_gcrs(start_ns: int) -> Array:
    """Rotation (3, 3) to a run's inertial frame: the celestial intermediate frame of its start, held fixed.

    The pole of date leaves it by some 0.1 arcsec a day, 3 m at the Earth's surface; a run's Earth keeps the
    pole of its start. Source: IAU 2006 precession, 2000A nutation (erfa.c2i06a)
    """
    return erfa.c2i06a(*tt_jd(start_ns))


def utc_jd(t_ns: int | Times) -> tuple[Array, Array]:
    """Julian date (UTC, taken for UT1) of GPS time t_ns (...,) [ns], in two parts: days, and the rest."""
    t_ns = np.asarray(t_ns, np.int64)
    leap_s = np.vectorize(gpstime.leap_seconds, otypes=[np.int64])(t_ns)
    days, rest_ns = np.divmod(t_ns - leap_s * gpstime.NS_PER_S, _DAY_NS)
    return _GPS_EPOCH_JD + days, rest_ns / _DAY_NS


def _about_z(angle_rad: Array) -> Array:
    """Rotations (..., 3, 3) of coordinates into axes turned about z by angles (...,) [rad]."""
    cos, sin, zero = np.cos(angle_rad), np.sin(angle_rad), np.zeros_like(angle_rad)
    rows = ((cos, sin, zero), (-sin, cos, zero), (zero, zero, zero + 1))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def ecef_from_gcrs(t_ns: int | Times) -> Array:
    """Rotations (..., 3, 3) from celestial to terrestrial axes: pole and origin of date, then the Earth's
    rotation angle. Source: IERS Conventions (2010), eq. 5.1 without polar motion"""
    return _about_z(erfa.era00(*utc_jd(t_ns))) @ cirs_from_gcrs(t_ns)


def ecef_from_teme(t_ns: int | Times) -> Array:
    """Rotations (..., 3, 3) from true equator, mean equinox of date to terrestrial axes.

    Source: Vallado et al., Revisiting Spacetrack Report #3, AIAA 2006-6753, appendix C: by GMST of 1982
    """
    return _about_z(erfa.gmst82(*utc_jd(t_ns)))
