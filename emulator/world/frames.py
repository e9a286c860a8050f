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
