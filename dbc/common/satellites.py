"""Navigation satellites as small integers.

A satellite is (system, number) on the bus and `index = 64 * system + number` inside arrays,
so that any table over all satellites is a plain array of SATELLITES rows.
"""

from __future__ import annotations

import re

import numpy as np

GPS, GLONASS, GALILEO, BEIDOU, SBAS, QZSS, INTERSATELLITE = range(7)

SYSTEM_NAMES = ("gps", "glonass", "galileo", "beidou", "sbas", "qzss", "intersatellite")
SYSTEM_LETTERS = "GRECSJI"  # RINEX 3 letters; I for later inter-satellite ranges

NUMBERS = 64
SATELLITES = NUMBERS * 8


def index(system, number):
    """Array index of satellite (system, number); vectorised."""
    return np.asarray(system) * NUMBERS + np.asarray(number)


def system_of(sat_index):
    return np.asarray(sat_index) // NUMBERS


def number_of(sat_index):
    return np.asarray(sat_index) % NUMBERS


def name(sat_index: int) -> str:
    """RINEX name of a satellite: 'G07', 'R21'; '7:63' of a system that has no letter."""
    system, number = divmod(int(sat_index), NUMBERS)
    prefix = SYSTEM_LETTERS[system] if system < len(SYSTEM_LETTERS) else f"{system}:"
    return f"{prefix}{number:02d}"


def parse(text: str) -> int:
    """Index from a RINEX name; ValueError if it is none."""
    match = re.fullmatch(rf"([{SYSTEM_LETTERS}])(\d\d)", text)
    if match is None or not 0 < int(match[2]) < NUMBERS:
        raise ValueError(f"'{text}' is not a satellite name such as G07 or R21")
    return SYSTEM_LETTERS.index(match[1]) * NUMBERS + int(match[2])
