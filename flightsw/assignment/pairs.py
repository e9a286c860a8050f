"""Satellites on pairs of channels: one decision of the policy, two channels of one antenna.

A policy chooses antennas for satellites, whatever they are tracked by
(`gnss_hil.flightsw.assignment.registry`). Where fixes are made of two signals of each satellite, it is asked
twice: for the satellites that have both, each of which takes two channels of its antenna, and with the
channels left for the others. These serve where pairs are too few for a fix.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.flightsw.assignment.registry import Assign

_PAIR = 2


def in_pairs(
    assign: Assign,
    angles_rad: F64,
    mask_rad: F64,
    channels: I64,
    previous: I64,
    options: Any,
    second: I64,
    single: Bool,
) -> tuple[I64, I64]:
    """The antenna of each visible satellite, (n,), -1 for none, and the signal that it is tracked by there
    beside its first, (n,), 0 for none; arguments as of the policy (`Assign`), and

    second   (m, n) signal that would make the pair, by antenna and satellite, 0 for none
    single   (n,) satellites to be tracked by their first signal alone
    """
    antenna = np.full(len(previous), -1, np.int64)
    chosen = np.zeros(len(previous), np.int64)
    paired = np.flatnonzero((second > 0).any(axis=0) & ~single)
    if len(paired):
        room = np.where((second > 0).any(axis=1), channels // _PAIR, 0)
        found = assign(angles_rad[:, paired], mask_rad, room, previous[paired], options)
        has = found >= 0
        antenna[paired] = found
        chosen[paired[has]] = second[found[has], paired[has]]
    taken = np.bincount(antenna[antenna >= 0], minlength=len(channels))
    taken += np.bincount(antenna[chosen > 0], minlength=len(channels))
    rest = np.flatnonzero(antenna < 0)
    if len(rest):
        antenna[rest] = assign(angles_rad[:, rest], mask_rad, channels - taken, previous[rest], options)
    return antenna, chosen
