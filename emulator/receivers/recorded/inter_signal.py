"""Clocks of single signals by what civil messages say of them.

A signal's clock is that of the pair of P codes less T_GD plus the signal's ISC; clocks of the first signal
have T_GD inside already. Tracked as a whole (X), L5 is taken for its pilot.
Source: IS-GPS-200, 30.3.3.3.1.1.1; IS-GPS-705, 20.3.3.3.1.2.1
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import satellites, signals
from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.earth.constants import LIGHT_MPS
from gnss_hil.emulator.files import rinex_cnav

_FIELD = {"L1CA": "L1CA", "L2C": "L2C", "L5": "L5Q5"}
"""Name of a signal -> of its correction in messages."""


def unknown() -> F64:
    """Corrections (COUNT, SATELLITES) of which none is known: nan."""
    return np.full((signals.COUNT, satellites.SATELLITES), np.nan)


def of_files(paths: Iterable[Path]) -> F64:
    """ISC (COUNT, SATELLITES) [m] by the signals' values on the bus and satellite index; nan where no file
    has it. FileError if one has faults."""
    found = unknown()
    for path in paths:
        for number, given in rinex_cnav.read(path).items():
            for name, field in _FIELD.items():
                if field in given:
                    sat = int(satellites.index(satellites.GPS, number))
                    found[signals.SIGNALS[name].value, sat] = LIGHT_MPS * given[field]
    return found
