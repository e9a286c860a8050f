"""Sun and Moon against published ephemerides."""

from __future__ import annotations

from datetime import datetime

import numpy as np

from dbc import gpstime
from emulator.world import bodies


def test_the_sun_is_overhead_at_noon_of_greenwich_at_an_equinox():
    """Equinox of 2013-03-20 11:02 UTC, equation of time -7.5 min (Astronomical Almanac)."""
    t_ns = np.array([gpstime.from_utc(datetime(2013, 3, 20, 12, 7, 30))])
    sun = bodies.sun_ecef_m(t_ns, 16)[0]
    assert abs(np.arctan2(sun[1], sun[0])) < 2e-3
    assert abs(sun[2]) / np.linalg.norm(sun) < 4e-4
