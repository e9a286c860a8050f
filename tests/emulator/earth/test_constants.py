"""Earth rotation against the IAU's own library (erfa), and published angles."""

from __future__ import annotations

from datetime import datetime

import erfa
import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.earth import constants

pytestmark = pytest.mark.verifies(
    "emulator/earth/constants.py",
    what="Earth rotation",
    by="erfa: era00 to 1e-11 rad, gmst82",
    status="validated",
)

GPS_EPOCH_JD = 2_444_244.5
MOMENTS = [datetime(1993, 7, 1), datetime(2012, 10, 31, 0, 15), datetime(2026, 2, 3, 4, 5, 6)]


def utc(t_ns):
    """Two-part Julian date, whole days apart from the rest."""
    days, rest_ns = divmod(t_ns - gpstime.leap_seconds(t_ns) * gpstime.NS_PER_S, 86_400 * gpstime.NS_PER_S)
    return GPS_EPOCH_JD + days, rest_ns / 86_400e9


@pytest.mark.parametrize("moment", MOMENTS)
def test_rotation_angle_is_era00(moment):
    t_ns = gpstime.from_calendar(moment)
    expected = erfa.era00(*utc(t_ns))
    assert constants.rotation_angle_rad(t_ns, gpstime.leap_seconds(t_ns)) == pytest.approx(
        expected, abs=1e-11
    )


@pytest.mark.parametrize("moment", MOMENTS)
def test_sidereal_angle_is_gmst82(moment):
    t_ns = gpstime.from_calendar(moment)
    expected = erfa.gmst82(*utc(t_ns))
    assert constants.sidereal_angle_rad(t_ns, gpstime.leap_seconds(t_ns)) == pytest.approx(
        expected, abs=1e-10
    )


def test_sidereal_angle_of_the_gps_reference_epoch():
    """GPS SPS Performance Standard, table 3.2-1: 18 h 36 min 14.4 s at 1993-07-01 00:00."""
    t_ns = gpstime.from_utc(datetime(1993, 7, 1))
    hours = np.degrees(constants.sidereal_angle_rad(t_ns, gpstime.leap_seconds(t_ns))) / 15
    assert hours == pytest.approx(18 + 36 / 60 + 14.4 / 3600, abs=2 / 3600)


def test_rotation_angle_grows_by_the_rotation_rate_and_ignores_leap_seconds_of_the_run():
    start_ns = gpstime.from_utc(datetime(2016, 12, 31, 23, 50))
    leap = gpstime.leap_seconds(start_ns)
    later_ns = start_ns + 1200 * gpstime.NS_PER_S
    assert gpstime.leap_seconds(later_ns) == leap + 1
    turned = constants.rotation_angle_rad(later_ns, leap) - constants.rotation_angle_rad(start_ns, leap)
    assert turned == pytest.approx(1200 * constants.ROTATION_RPS, abs=1e-12)


def test_eci_to_ecef_turns_eastward_points_back():
    """A point fixed in inertial space on the x axis moves west, to -y, as the Earth turns east."""
    turned = constants.eci_to_ecef(np.array((7e6, 0.0, 1e6)), np.array(0.1))
    assert turned == pytest.approx((7e6 * np.cos(0.1), -7e6 * np.sin(0.1), 1e6))
