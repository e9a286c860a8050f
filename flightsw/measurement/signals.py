"""Ranging signals by their number in the contract: carriers, preference, pairs, from the contract's table.

What a channel tracks, a satellite by one of its signals, is one number, its *track*: the satellite's index
where it is the system's first signal, else that and SATELLITES times the signal's number.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.satellites import NUMBERS, SATELLITES
from gnss_hil.dbc.common.signals import SIGNALS, Signal
from gnss_hil.dbc.common.systems import COUNT as SYSTEMS_COUNT
from gnss_hil.dbc.common.systems import SYSTEMS, reference

_CHOSEN_PAIRS = (
    ("L1P", "L2P"),
    ("L1CA", "L2C"),
    ("L1CA", "L2P"),
    ("L1P", "L2C"),
    ("L1CA", "L5"),
    ("L1P", "L5"),
    ("L1OF", "L2OF"),
)
"""The most wanted first: codes of one kind before mixed ones, L2 before L5."""


def _pairs() -> tuple[tuple[Signal, Signal], ...]:
    """Signals of two bands of a system that make a range without ionosphere: the chosen pairs, and for other
    systems all, in the order of the table."""
    chosen = [(SIGNALS[a], SIGNALS[b]) for a, b in _CHOSEN_PAIRS if a in SIGNALS and b in SIGNALS]
    done = {a.system for a, _ in chosen}
    others = [
        (a, b)
        for a, b in combinations(SIGNALS.values(), 2)
        if a.system == b.system and a.system not in done and a.carrier_hz != b.carrier_hz
    ]
    return (*chosen, *others)


PAIRS = tuple((first.value, second.value) for first, second in _pairs())

_RANK_OF = {signal.value: rank for rank, signal in enumerate(SIGNALS.values())}
RANK = np.array([_RANK_OF.get(value, signals.COUNT) for value in range(signals.COUNT)])
"""Which signal of a satellite is used alone: the lowest rank, the table's order."""

_BASE_HZ: F64 = signals.column(lambda signal: signal.carrier_hz, np.nan)
_STEP_HZ: F64 = signals.column(lambda signal: signal.spacing_hz, 0.0)
_REFERENCE_HZ = float(_BASE_HZ[signals.of_system(reference())[0].value])
_FIRST: I64 = signals.first_column(lambda signal: signal.value, 0)
_BEYOND: I64 = signals.beyond_first() * SATELLITES
for _table in (_BASE_HZ, _STEP_HZ, RANK, _FIRST, _BEYOND):
    _table.setflags(write=False)


def track_of(sat: I64, signal: I64) -> I64:
    """(n,) tracks of satellites by signals (n,)."""
    return sat + _BEYOND[signal]


def satellite_of(track: I64) -> I64:
    """(n,) satellites of tracks (n,)."""
    return track % SATELLITES


def signal_of(track: I64) -> I64:
    """(n,) signals of tracks (n,)."""
    number = track // SATELLITES
    return np.where(number > 0, number, _FIRST[track % SATELLITES // NUMBERS])


def seconds(other_signals: Sequence[Sequence[str]]) -> I64:
    """(m, 8) by receiver and system: the signal that makes a pair with the system's first, the most wanted of
    those that the receiver tracks; 0 where there is none.

    other_signals   (m,) names of what receivers track beside the systems' first signals
    """
    found = np.zeros((len(other_signals), SYSTEMS_COUNT), np.int64)
    for first, second in reversed(PAIRS):
        signal = signals.by_value(second)
        assert signal is not None, "pairs are of the table"
        system = SYSTEMS[signal.system].value
        if first == _FIRST[system]:
            found[[signal.name in names for names in other_signals], system] = second
    return found


def carrier_hz(signal: I64, frequency: F64) -> F64:
    """(n,) carriers of signals (n,) and frequency numbers (n,); nan where a number is no signal."""
    return _BASE_HZ[signal] + _STEP_HZ[signal] * frequency


def electrons(signal: I64, frequency: F64) -> F64:
    """(n,) ionospheric delay of signals (n,) over that of the reference system's first, by carrier."""
    return (_REFERENCE_HZ / carrier_hz(signal, frequency)) ** 2
