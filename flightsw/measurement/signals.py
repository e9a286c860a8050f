"""Ranging signals by their number in the contract (table "Signal"): carriers, preference, pairs.

Sources: IS-GPS-200 3.3.1.1 (L1, L2), IS-GPS-705 3.3.1.1 (L5), Galileo OS SIS ICD 2.1 (E1), GLONASS ICD L1, L2
5.1, 3.3.1.1 (frequency k: 1602 + 0.5625 k and 1246 + 0.4375 k MHz)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import GLONASS, NUMBERS
from gnss_hil.dbc.contract.messages import VALUES

NUMBER = {label: raw for raw, label in VALUES["Signal"].items()}

_CARRIERS_HZ = {
    # signal: (carrier, step of a GLONASS frequency number)
    "L1CA": (1575.42e6, 0.0),
    "L1P": (1575.42e6, 0.0),
    "E1": (1575.42e6, 0.0),
    "L2C": (1227.60e6, 0.0),
    "L2P": (1227.60e6, 0.0),
    "L5": (1176.45e6, 0.0),
    "L1OF": (1602e6, 0.5625e6),
    "L2OF": (1246e6, 0.4375e6),
}

_FIRST_CHOICE = ("L1CA", "L1OF", "E1", "L1P", "L5", "L2C", "L2P", "L2OF")
"""Which signal of a satellite is used alone: the first band before others, there the code that is open."""

PAIRS = tuple(
    (NUMBER[first], NUMBER[second])
    for first, second in (
        ("L1P", "L2P"),
        ("L1CA", "L2C"),
        ("L1CA", "L2P"),
        ("L1P", "L2C"),
        ("L1CA", "L5"),
        ("L1P", "L5"),
        ("L1OF", "L2OF"),
    )
)
"""Signals of two bands that make a range without ionosphere, the most wanted first: codes of one kind before
mixed ones, wide spacing of carriers before narrow noise."""

_TOP = 16  # numbers that four bits can name
_BASE_HZ, _STEP_HZ, RANK = np.full(_TOP, np.nan), np.zeros(_TOP), np.full(_TOP, _TOP)
for _rank, _name in enumerate(_FIRST_CHOICE):
    _BASE_HZ[NUMBER[_name]], _STEP_HZ[NUMBER[_name]] = _CARRIERS_HZ[_name]
    RANK[NUMBER[_name]] = _rank
for _table in (_BASE_HZ, _STEP_HZ, RANK):
    _table.setflags(write=False)


def commanded_signal(sat: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) the signal a satellite is commanded on."""
    return np.where(sat // NUMBERS == GLONASS, NUMBER["L1OF"], NUMBER["L1CA"])


def carrier_hz(signal: NDArray[np.int64], frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) carriers of signals (n,) and GLONASS frequency numbers (n,); nan where a number is no signal."""
    return _BASE_HZ[signal] + _STEP_HZ[signal] * frequency
