"""Ranging signals by their number in the contract: carriers, preference, pairs, from the contract's table."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.satellites import NUMBERS
from gnss_hil.dbc.common.signals import SIGNALS, Signal

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
_COMMANDED: I64 = signals.first_column(lambda signal: signal.value, 0)
for _table in (_BASE_HZ, _STEP_HZ, RANK, _COMMANDED):
    _table.setflags(write=False)


def commanded_signal(sat: I64) -> I64:
    """(n,) the signal that satellites (n,) are commanded on: their system's first."""
    return _COMMANDED[sat // NUMBERS]


def carrier_hz(signal: I64, frequency: F64) -> F64:
    """(n,) carriers of signals (n,) and frequency numbers (n,); nan where a number is no signal."""
    return _BASE_HZ[signal] + _STEP_HZ[signal] * frequency
