"""Time against published instants."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import erfa
import pytest

from gnss_hil.dbc.common import gpstime

pytestmark = pytest.mark.verifies(
    "dbc/common/gpstime.py",
    what="Time scales",
    by="week roll-overs, IERS Bulletin C",
    status="validated",
)


@pytest.mark.parametrize(
    ("moment", "week", "second"),
    [
        (datetime(1980, 1, 6), 0, 0),
        (datetime(1999, 8, 22), 1024, 0),  # first week roll-over, GPS time
        (datetime(2019, 4, 7), 2048, 0),  # second week roll-over, GPS time
        (datetime(2012, 10, 31, 0, 15), 1712, 3 * 86400 + 900),
    ],
)
def test_weeks(moment, week, second):
    t_ns = gpstime.from_calendar(moment)
    assert gpstime.week_second_ns(t_ns) == (week, second, 0)
    assert gpstime.from_week(week, second) == t_ns
    assert gpstime.to_calendar(t_ns) == moment


@pytest.mark.parametrize(
    ("utc", "leap"),
    [
        (datetime(1980, 1, 6), 0),
        (datetime(2009, 4, 1), 15),
        (datetime(2012, 6, 30, 23, 59, 59), 15),
        (datetime(2012, 7, 1), 16),
        (datetime(2016, 12, 31, 23, 59, 59), 17),
        (datetime(2017, 1, 1), 18),
        (datetime(2026, 1, 1), 18),
    ],
)
def test_leap_seconds_of_bulletin_c(utc, leap):
    t_ns = gpstime.from_utc(utc)
    assert gpstime.leap_seconds(t_ns) == leap
    assert t_ns == gpstime.from_calendar(utc) + leap * gpstime.NS_PER_S
    assert gpstime.to_unix_ns(t_ns) == int(utc.replace(tzinfo=UTC).timestamp()) * gpstime.NS_PER_S
    assert gpstime.from_unix_ns(gpstime.to_unix_ns(t_ns) + 5) == t_ns + 5


def test_nanoseconds_survive():
    t_ns = gpstime.from_week(2400, 604_799, 999_999_999)
    assert gpstime.week_second_ns(t_ns) == (2400, 604_799, 999_999_999)
    assert gpstime.week_second_ns(t_ns + 1) == (2401, 0, 0)


def test_leap_seconds_are_those_of_erfa():
    """Every month since the GPS epoch, its first instant and the last second before it; TAI is GPS + 19 s."""
    for month in range(1, 12 * 47):
        first = datetime(1980 + month // 12, month % 12 + 1, 1)
        for moment in (first, first - timedelta(seconds=1)):
            expected = round(float(erfa.dat(moment.year, moment.month, moment.day, 0.0))) - 19
            assert gpstime.leap_seconds(gpstime.from_utc(moment)) == expected, moment


def test_instants_that_64_bits_do_not_hold_are_refused():
    for year in (1691, 2269):
        assert abs(gpstime.from_calendar(datetime(year, 6, 1))) < 2**63
    for year in (1, 1600, 2300, 9999):
        with pytest.raises(ValueError, match="too far from 1980"):
            gpstime.from_calendar(datetime(year, 1, 1))
