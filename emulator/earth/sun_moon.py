"""Where the Sun and the Moon are: geometric, geocentric, metres.

Against VSOP2013 and ELP2000 the Sun is within 11 km, the Moon within 17 km.
Source: erfa.epv00 (Bretagnon's VSOP2000, abridged by SOFA) and erfa.moon98 (Meeus 1998 after Chapront's
ELP2000), both in GCRS axes. TDB - TT, below 2 ms, is left out.
"""

from __future__ import annotations

import erfa
import numpy as np
from numpy.polynomial import chebyshev

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.earth.constants import eci_to_ecef, rotation_angle_rad
from gnss_hil.emulator.earth.frames import cirs_from_gcrs, eci_from_gcrs, tt_jd
from gnss_hil.emulator.numerics.chebyshev import NS_PER_S, Chunks, Grid, lobatto_nodes

AU_M = 149_597_870_700.0
"""Astronomical unit. IAU 2012 resolution B2."""

MU_SUN_M3PS2 = 1.32712440041939e20
MU_MOON_M3PS2 = 4.902800066e12
"""Gravitational parameters of DE430 (Folkner et al., IPN Progress Report 42-196, 2014, table 8)."""

_DEGREE = 12


def sun_gcrs_m(t_ns: I64) -> F64:
    """The Sun (n, 3) [m], GCRS, at GPS times t_ns (n,) [ns]."""
    heliocentric, _ = erfa.epv00(*tt_jd(t_ns))
    return -AU_M * heliocentric["p"]


def moon_gcrs_m(t_ns: I64) -> F64:
    """The Moon (n, 3) [m], GCRS, at GPS times t_ns (n,) [ns]."""
    return AU_M * erfa.moon98(*tt_jd(t_ns))["p"]


def sun_ecef_m(t_ns: I64, leap_s: int) -> F64:
    """The Sun (n, 3) [m], ecef of that instant.

    t_ns    (n,) GPS time [ns]
    leap_s  GPS - UTC [s] of the run's start
    """
    of_date = np.einsum("nij,nj->ni", cirs_from_gcrs(t_ns), sun_gcrs_m(t_ns))
    return eci_to_ecef(of_date, rotation_angle_rad(t_ns, leap_s))


class InertialBodies:
    """Sun and Moon in the eci frame of a run that starts at start_ns, read from six-hour polynomials."""

    def __init__(self, start_ns: int):
        self._grid = Grid(start_ns, 6 * 3600 * NS_PER_S, 0, _DEGREE, per_chunk=1)
        self._eci_from_gcrs = eci_from_gcrs(start_ns)
        self._chunks = Chunks(self._fit)

    def at(self, t_ns: I64) -> tuple[F64, F64]:
        """Sun and Moon (k, 3) each, eci [m], at GPS times t_ns (k,) [ns]."""
        grid = self._grid
        segments = (t_ns - grid.origin_ns) // grid.segment_ns
        first, last = int(segments.min()), int(segments.max())
        places = np.empty((len(t_ns), 6))
        for segment in range(first, last + 1):
            rows = segments == segment if first < last else slice(None)
            x = (t_ns[rows] - int(grid.middles_ns(segment)[0])) / (NS_PER_S * grid.half_s)
            places[rows] = chebyshev.chebvander(x, _DEGREE) @ self._chunks[segment]
        return places[:, :3], places[:, 3:]

    def _fit(self, segment: int) -> F64:
        """Coefficients (degree + 1, 6) of one segment."""
        nodes_ns = np.rint(lobatto_nodes(_DEGREE) * self._grid.half_s * NS_PER_S).astype(np.int64)
        t_ns = self._grid.middles_ns(segment) + nodes_ns
        gcrs = np.stack((sun_gcrs_m(t_ns), moon_gcrs_m(t_ns)), axis=1)
        return self._grid.fit((gcrs @ self._eci_from_gcrs.T).reshape(-1, 6))
