"""What RINEX files have in common: lines of a header, instants, numbers."""

from __future__ import annotations

from datetime import datetime
from textwrap import wrap

from gnss_hil.dbc.common import gpstime

VERSION = 3.04
"""Of both kinds of file: GLONASS navigation records of 3.05 have a line more, which older readers trip on."""


def labelled(content: str, label: str) -> str:
    """A header line: content in columns 1 to 60, label behind; what is longer is cut."""
    return f"{content:<60.60}{label:<20}".rstrip() + "\n"


def comments(text: str) -> str:
    """COMMENT lines of a text, wrapped at words."""
    lines = wrap(text, 60, break_long_words=False, break_on_hyphens=False)
    return "".join(labelled(line, "COMMENT") for line in lines)


def instant(t_ns: int) -> tuple[datetime, str]:
    """Calendar instant to the minute and seconds F10.7 of GPS time t_ns, to 100 ns."""
    minute, ticks = divmod((t_ns + 50) // 100, 600_000_000)
    seconds = f"{ticks // 10_000_000:2d}.{ticks % 10_000_000:07d}"
    return gpstime.to_calendar(minute * 60 * gpstime.NS_PER_S), seconds


def leap_seconds(t_ns: int) -> str:
    return labelled(f"{gpstime.leap_seconds(t_ns):6d}", "LEAP SECONDS")
