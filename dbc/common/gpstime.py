"""GPS time as integer nanoseconds since 1980-01-06 00:00:00 (GPS), full weeks.

A float of GPS seconds resolves 0.24 us today, 71 m of range: time is never carried as one.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

NS_PER_S = 1_000_000_000
S_PER_WEEK = 604_800
NS_PER_DAY = 86_400 * NS_PER_S
NS_PER_WEEK = S_PER_WEEK * NS_PER_S

_FARTHEST_NS = 290 * 365 * NS_PER_DAY

UNIX_OF_GPS_EPOCH_S = 315_964_800
_GPS_EPOCH = datetime(1980, 1, 6)

# First UTC instant of each GPS - UTC value since the GPS epoch. Source: IERS Bulletin C, Leap_Second.dat.
_LEAP_STEPS = (
    (datetime(1981, 7, 1), 1), (datetime(1982, 7, 1), 2), (datetime(1983, 7, 1), 3),
    (datetime(1985, 7, 1), 4), (datetime(1988, 1, 1), 5), (datetime(1990, 1, 1), 6),
    (datetime(1991, 1, 1), 7), (datetime(1992, 7, 1), 8), (datetime(1993, 7, 1), 9),
    (datetime(1994, 7, 1), 10), (datetime(1996, 1, 1), 11), (datetime(1997, 7, 1), 12),
    (datetime(1999, 1, 1), 13), (datetime(2006, 1, 1), 14), (datetime(2009, 1, 1), 15),
    (datetime(2012, 7, 1), 16), (datetime(2015, 7, 1), 17), (datetime(2017, 1, 1), 18),
)  # fmt: skip
LEAPS_UNIX_S = tuple(int(utc.replace(tzinfo=UTC).timestamp()) for utc, _ in _LEAP_STEPS)
"""UNIX times behind the leap seconds, in order."""
_LEAP_GPS_NS = tuple(
    (((utc - _GPS_EPOCH) // timedelta(seconds=1) + leap) * NS_PER_S, leap) for utc, leap in _LEAP_STEPS
)


def leap_seconds(t_ns: int) -> int:
    """GPS - UTC [s] at GPS time t_ns."""
    return next((leap for start_ns, leap in reversed(_LEAP_GPS_NS) if t_ns >= start_ns), 0)


def from_calendar(moment: datetime) -> int:
    """GPS time [ns] of a calendar instant on the GPS scale; ValueError beyond 1691 to 2269, where 64 bits of
    nanoseconds end."""
    t_ns = round((moment.replace(tzinfo=None) - _GPS_EPOCH) / timedelta(microseconds=1)) * 1000
    if abs(t_ns) > _FARTHEST_NS:
        raise ValueError(f"{moment} is too far from 1980")
    return t_ns


def from_utc(moment: datetime) -> int:
    """GPS time [ns] of a UTC calendar instant (not inside a leap second)."""
    t_ns = from_calendar(moment)
    offset = next((leap for utc, leap in reversed(_LEAP_STEPS) if moment.replace(tzinfo=None) >= utc), 0)
    return t_ns + offset * NS_PER_S


def to_calendar(t_ns: int) -> datetime:
    """Calendar instant on the GPS scale, to the microsecond."""
    return _GPS_EPOCH + timedelta(microseconds=t_ns // 1000)


def to_unix_ns(t_ns: int) -> int:
    """UNIX (UTC) time [ns] of GPS time t_ns."""
    return t_ns + (UNIX_OF_GPS_EPOCH_S - leap_seconds(t_ns)) * NS_PER_S


def from_unix_ns(unix_ns: int) -> int:
    """GPS time [ns] of a UNIX (UTC) time."""
    return from_utc(datetime.fromtimestamp(unix_ns // NS_PER_S, UTC)) + unix_ns % NS_PER_S


def week_second_ns(t_ns: int) -> tuple[int, int, int]:
    """Full GPS week, second of week, nanosecond of second."""
    week, rest = divmod(t_ns, NS_PER_WEEK)
    return week, rest // NS_PER_S, rest % NS_PER_S


def from_week(week: int, second: int, ns: int = 0) -> int:
    return week * NS_PER_WEEK + second * NS_PER_S + ns


def iso(t_ns: int) -> str:
    """'2012-10-31T00:15:00' on the GPS scale, with decimals only where there are any."""
    return to_calendar(t_ns).isoformat()
