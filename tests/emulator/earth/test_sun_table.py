"""The Sun over a run: the table against the series it samples."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.earth.sun_moon import sun_ecef_m
from gnss_hil.emulator.earth.sun_table import Sun

START_NS = gpstime.from_utc(datetime(2012, 10, 31, 0, 15))


def test_the_table_is_the_series():
    """To 20 m of 1.5e8 km: 3e-5 arcsec."""
    table = Sun(16)
    for minutes in (0, 17, 59, 60, 733, 1500):
        t_ns = START_NS + minutes * 60 * 10**9
        assert table.at(t_ns) == pytest.approx(sun_ecef_m(np.array([t_ns]), 16)[0], abs=20)
