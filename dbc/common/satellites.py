"""Navigation satellites as small integers.

A satellite is (system, number) on the bus and `index = 64 * system + number` inside arrays,
so that any table over all satellites is a plain array of SATELLITES rows.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.common.systems import SYSTEMS

GPS, GLONASS = SYSTEMS["gps"].value, SYSTEMS["glonass"].value

NUMBERS = 64
SATELLITES = NUMBERS * systems.COUNT


def index(system: ArrayLike, number: ArrayLike) -> NDArray[np.int64]:
    """Array index of satellite (system, number); vectorised."""
    return np.asarray(system) * NUMBERS + np.asarray(number)


def system_of(sat_index: ArrayLike) -> NDArray[np.int64]:
    return np.asarray(sat_index) // NUMBERS


def number_of(sat_index: ArrayLike) -> NDArray[np.int64]:
    return np.asarray(sat_index) % NUMBERS


def name(sat_index: int) -> str:
    """RINEX name of a satellite: 'G07', 'R21'; '7:63' of a system that has no letter."""
    value, number = divmod(int(sat_index), NUMBERS)
    system = systems.by_value(value)
    prefix = f"{value}:" if system is None else system.letter
    return f"{prefix}{number:02d}"


def listed(sat_index: ArrayLike, most: int = 8) -> str:
    """Names of satellites for people: 'G01, G07 and R21'; of many the first ones and how many more."""
    names = [name(one) for one in np.unique(sat_index).tolist()]
    if len(names) > most:
        names = [*names[:most], f"{len(names) - most} more"]
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1]))) if names else ""


def parse(text: str) -> int:
    """Index from a RINEX name; ValueError if it is none."""
    match = re.fullmatch(r"([A-Z])(\d\d)", text)
    system = systems.by_letter(match[1]) if match else None
    if match is None or system is None or not 0 < int(match[2]) < NUMBERS:
        raise ValueError(f"'{text}' is not a satellite name such as G07 or R21")
    return system.value * NUMBERS + int(match[2])
