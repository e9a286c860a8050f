"""Where the Sun and the Moon are: geometric, geocentric, metres.

The Sun is good to some 10 km (1800-2200: 11 km in the Earth's heliocentric place), the Moon to some 10 km.
Source: erfa.epv00 (Bretagnon's VSOP2000, abridged by SOFA) and erfa.moon98 (Meeus 1998 after Chapront's
ELP2000), both in GCRS axes. TDB - TT, below 2 ms, is left out.
"""

from __future__ import annotations

import erfa
import numpy as np
from numpy.typing import NDArray

from emulator.world.earth import eci_to_ecef, rotation_angle_rad
from emulator.world.frames import cirs_from_gcrs, tt_jd

Array = NDArray[np.float64]
Times = NDArray[np.int64]

AU_M = 149_597_870_700.0
"""Astronomical unit. IAU 2012 resolution B2."""


def sun_gcrs_m(t_ns: Times) -> Array:
    """The Sun (n, 3) [m], GCRS, at GPS times t_ns (n,) [ns]."""
    heliocentric, _ = erfa.epv00(*tt_jd(t_ns))
    return -AU_M * heliocentric["p"]


def moon_gcrs_m(t_ns: Times) -> Array:
    """The Moon (n, 3) [m], GCRS, at GPS times t_ns (n,) [ns]."""
    return AU_M * erfa.moon98(*tt_jd(t_ns))["p"]


def _in_ecef(pos_gcrs_m: Array, t_ns: Times, leap_s: int) -> Array:
    of_date = np.einsum("nij,nj->ni", cirs_from_gcrs(t_ns), pos_gcrs_m)
    return eci_to_ecef(of_date, rotation_angle_rad(t_ns, leap_s))


def sun_ecef_m(t_ns: Times, leap_s: int) -> Array:
    """The Sun (n, 3) [m], ecef of that instant.

    t_ns    (n,) GPS time [ns]
    leap_s  GPS - UTC [s] of the run's start
    """
    return _in_ecef(sun_gcrs_m(t_ns), t_ns, leap_s)


def moon_ecef_m(t_ns: Times, leap_s: int) -> Array:
    """The Moon (n, 3) [m], ecef of that instant; arguments as `sun_ecef_m`."""
    return _in_ecef(moon_gcrs_m(t_ns), t_ns, leap_s)
