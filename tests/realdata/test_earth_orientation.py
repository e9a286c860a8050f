"""The Earth's orientation as measured: what is known of it since 1980 in one file."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from dbc import gpstime
from emulator.files import finals
from tests.realdata import data_file

pytestmark = pytest.mark.realdata


def test_the_whole_file_is_read_and_knows_vallados_example():
    """Vallado, Fundamentals of Astrodynamics, example 3-15, which takes the values of 2004-04-06 00:00."""
    read = finals.read(data_file("environment/finals2000A.all.gz"))
    assert len(read.t_ns) > 16_000
    ut1_gps_s, pole_rad = read.at(np.array(gpstime.from_utc(datetime(2004, 4, 6))))
    assert ut1_gps_s + 13 == pytest.approx(-0.4399619, abs=2e-5)
    # The pole has been computed anew since his edition.
    assert pole_rad * 648_000 / np.pi == pytest.approx([-0.140682, 0.333309], abs=5e-4)
    # UT1 - GPS has no leap seconds: it drifts by some milliseconds a day, never by a second.
    assert np.abs(np.diff(read.ut1_gps_s)).max() < 5e-3
