"""Antenna patterns over the whole sphere: gain by the angle off the axis, as tables on one grid.

A pattern is given at a few angles; between them it is linear in dB. On a grid of a quarter degree every
look-up is two reads of a flat array, and nodes at whole degrees lose nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gnss_hil.dbc.common.arrays import F64, Index
from gnss_hil.emulator.files.antenna_table import Pattern

NODES = 721
GRID_DEG = np.linspace(0.0, 180.0, NODES)
_PER_RAD = (NODES - 1) / np.pi

ABSENT_DB = -300.0
"""Where nothing is published, nothing is sent or received: no receiver hears what is so far down, and sums
of it stay finite."""


def cosine_law(boresight_dbi: float, at_90deg_dbi: float) -> Pattern:
    """The two-parameter law of `gnss_hil.emulator.signal.simple_link_budget.gain_dbi`, in dB linear in the
    cosine."""
    gain = at_90deg_dbi + (boresight_dbi - at_90deg_dbi) * np.cos(np.radians(GRID_DEG))
    return Pattern(GRID_DEG, gain, "linear in the cosine")


def on_grid(pattern: Pattern, floor_db: float | None = None) -> F64:
    """Gains (721,) at GRID_DEG.

    floor_db   gain at 180 deg of a pattern that ends before: from its last angle a straight line leads there.
               None: behind its last angle there is nothing, ABSENT_DB
    """
    angle, gain = pattern.angle_deg, pattern.gain_db
    if angle[-1] < 180.0 and floor_db is not None:
        angle, gain = np.append(angle, 180.0), np.append(gain, floor_db)
    return np.where(angle[-1] >= GRID_DEG, np.interp(GRID_DEG, angle, gain), ABSENT_DB)


def look_up(tables: F64, row: ArrayLike, angle_rad: F64) -> F64:
    """Values [dB] of tables (r, 721) on the grid at angles from 0 to pi [rad]; row and angles broadcast."""
    place = angle_rad * _PER_RAD
    left = np.minimum(place.astype(np.intp), NODES - 2)
    share = place - left
    left += np.asarray(row, np.intp) * NODES
    flat = tables.reshape(-1)
    low = flat.take(left)
    return low + share * (flat.take(left + 1) - low)


@dataclass(frozen=True, slots=True, eq=False)
class Receive:
    """Receiving antennas of a craft.

    right_dbi   (r, 721) gain of the pattern for right-handed waves
    row         (m,) pattern of each antenna
    """

    right_dbi: F64
    row: Index


def receive(patterns: tuple[Pattern, ...], floor_dbi: float | None = None) -> Receive:
    """Receiving antennas from one pattern for each; floor_dbi at 180 deg where one ends before, None: nothing
    behind its last angle."""
    distinct = list(dict.fromkeys(patterns))
    right = np.array([on_grid(pattern, floor_dbi) for pattern in distinct])
    row = np.array([distinct.index(pattern) for pattern in patterns])
    return Receive(right, row)


def gain_dbi(antennas: Receive, angle_rad: F64) -> F64:
    """Gain (m, n) [dBi] for right-handed waves at angles (m, n) off each antenna's boresight [rad]."""
    return look_up(antennas.right_dbi, antennas.row[:, None], angle_rad)
