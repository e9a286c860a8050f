"""Celestial and terrestrial frames: matrices, vectorised over time.

gcrs     geocentric celestial reference system
eme2000  mean equator and equinox of J2000: off the gcrs by a fixed 23 mas
cirs     celestial intermediate frame of date: z is the pole, x the intermediate origin (IAU 2006/2000A)
teme     true equator of date, mean equinox: what two-line elements propagate in
eci      of a run: the cirs of its start, held fixed; what the craft's motion is computed in
ecef     WGS-84 = ITRS

Without measured orientation UT1 is UTC and the pole is the intermediate one. In low orbit that costs up to
450 m (UT1 - UTC reaches 0.9 s) and 20 m (the pole 0.6 arcsec), and at a leap second the Earth jumps. With it
some centimetres are left: tides within a day, and 0.3 mas of the pole of date that no theory predicts.

Source: IERS Conventions (2010), chapter 5; the series are those of ERFA (SOFA).
"""

from __future__ import annotations

import erfa
import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.files.finals import Orientation

_DAY_NS = 86_400_000_000_000
_GPS_EPOCH_JD = 2_444_244.5
_TT_MINUS_GPS_DAYS = 51.184 / 86400
"""TT - TAI = 32.184 s, TAI - GPS = 19 s."""

_GCRS_FROM_EME2000 = erfa.bp06(erfa.DJ00, 0.0)[0].T
"""The frame bias, (3, 3): 0.8 m in low orbit. Source: erfa.bp06 (IERS Conventions 2010, 5.32 and 5.33)"""


def tt_jd(t_ns: int | I64) -> tuple[F64, F64]:
    """Julian date (TT) of GPS time t_ns (...,) [ns], in two parts: whole days, and the rest."""
    days, rest_ns = np.divmod(np.asarray(t_ns, np.int64), _DAY_NS)
    return _GPS_EPOCH_JD + days, rest_ns / _DAY_NS + _TT_MINUS_GPS_DAYS


def cirs_from_gcrs(t_ns: int | I64) -> F64:
    """Rotations (..., 3, 3) to the celestial intermediate frame of date.

    Source: IAU 2006 precession, 2000A nutation (erfa.c2i06a)
    """
    return erfa.c2i06a(*tt_jd(t_ns))


def eci_from_gcrs(start_ns: int) -> F64:
    """Rotation (3, 3) to a run's inertial frame: the celestial intermediate frame of its start, held fixed.

    The pole of date leaves it by some 0.1 arcsec a day, 3 m at the Earth's surface; a run's Earth keeps the
    pole of its start.
    """
    return cirs_from_gcrs(start_ns)


def utc_jd(t_ns: int | I64) -> tuple[F64, F64]:
    """Julian date (UTC, taken for UT1) of GPS time t_ns (...,) [ns], in two parts: days, and the rest."""
    t_ns = np.asarray(t_ns, np.int64)
    leap_s = np.vectorize(gpstime.leap_seconds, otypes=[np.int64])(t_ns)
    days, rest_ns = np.divmod(t_ns - leap_s * gpstime.NS_PER_S, _DAY_NS)
    return _GPS_EPOCH_JD + days, rest_ns / _DAY_NS


def _about_z(angle_rad: F64) -> F64:
    """Rotations (..., 3, 3) of coordinates into axes turned about z by angles (...,) [rad]."""
    cos, sin, zero = np.cos(angle_rad), np.sin(angle_rad), np.zeros_like(angle_rad)
    rows = ((cos, sin, zero), (-sin, cos, zero), (zero, zero, zero + 1))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _ut1_jd(t_ns: int | I64, measured: Orientation | None) -> tuple[F64, F64]:
    if measured is None:
        return utc_jd(t_ns)
    days, rest_ns = np.divmod(np.asarray(t_ns, np.int64), _DAY_NS)
    return _GPS_EPOCH_JD + days, rest_ns / _DAY_NS + measured.at(np.asarray(t_ns, np.int64))[0] / 86400


def _ecef_from_tirs(t_ns: int | I64, measured: Orientation | None) -> F64:
    """Rotations (..., 3, 3) by which the pole moves in the Earth."""
    if measured is None:
        return np.broadcast_to(np.eye(3), (*np.shape(t_ns), 3, 3))
    pole_rad = measured.at(np.asarray(t_ns, np.int64))[1]
    return erfa.pom00(pole_rad[..., 0], pole_rad[..., 1], erfa.sp00(*tt_jd(t_ns)))


def ecef_from_gcrs(t_ns: int | I64, measured: Orientation | None = None) -> F64:
    """Rotations (..., 3, 3) from celestial to terrestrial axes: pole and origin of date, the Earth's rotation
    angle, and, if measured, the pole's motion. Source: IERS Conventions (2010), eq. 5.1"""
    turned = _about_z(erfa.era00(*_ut1_jd(t_ns, measured))) @ cirs_from_gcrs(t_ns)
    return _ecef_from_tirs(t_ns, measured) @ turned


def ecef_from_eme2000(t_ns: int | I64, measured: Orientation | None = None) -> F64:
    """Rotations (..., 3, 3) from the mean equator and equinox of J2000 to terrestrial axes."""
    return ecef_from_gcrs(t_ns, measured) @ _GCRS_FROM_EME2000


def ecef_from_teme(t_ns: int | I64, measured: Orientation | None = None) -> F64:
    """Rotations (..., 3, 3) from true equator, mean equinox of date to terrestrial axes.

    Source: Vallado et al., Revisiting Spacetrack Report #3, AIAA 2006-6753, appendix C: by GMST of 1982
    """
    return _ecef_from_tirs(t_ns, measured) @ _about_z(erfa.gmst82(*_ut1_jd(t_ns, measured)))
