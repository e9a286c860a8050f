"""Precise orbits as what satellites report: a constellation without messages of its own.

For receivers whose observations are played, and where the best known sky is wanted on the bus. Clocks are
those of ionosphere-free ranges: no group delay is inside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common import satellites, signals, systems
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.systems import System
from gnss_hil.emulator.constellation import phase_centre, precise
from gnss_hil.emulator.constellation.base import PRECISE, Broadcast
from gnss_hil.emulator.constellation.precise import LayeredOrbits, PreciseOrbits
from gnss_hil.emulator.files import sp3
from gnss_hil.emulator.files.sp3 import Sp3

Orbits = PreciseOrbits | LayeredOrbits


def _share(system: System) -> float:
    """What ranges without ionosphere have of the delay by which a system's second carrier leaves later."""
    mine = signals.of_system(system)
    second = next((signal for signal in mine if signal.group_delay == "delta_tau"), None)
    return 0.0 if second is None else 1 / ((mine[0].carrier_hz / second.carrier_hz) ** 2 - 1)


_SHARE: F64 = systems.column(_share, 0.0)


def of_two_frequencies_m(index: I64, broadcast: Broadcast) -> F64:
    """By how much clocks [m], to be added to ranges, of ranges without ionosphere are more than those of the
    first signals of satellites index (n,), by what satellites broadcast (s, n): (s, n).

    T_GD is defined as that; where the second carrier leaves Delta tau later, the combination of both leaves
    Delta tau / ((f1 / f2)^2 - 1) later than the first, 1.53 Delta tau for GLONASS.
    Source: IS-GPS-200, 20.3.3.3.3.2; GLONASS ICD 5.1 (2008), 4.4
    """
    share = _SHARE[satellites.system_of(index)]
    return broadcast.group_delay_m + share * broadcast.band_delay_m


def read(paths: Sequence[Path], day: date) -> tuple[Sp3, Orbits]:
    """What the files have, later ones winning, and the orbits of the antennas of the satellites that flew on
    that day.

    FileError or ValueError with one line if they cannot be had.
    """
    product = sp3.joined([sp3.read(path) for path in paths])
    return product, precise.layered(product, phase_centre.offsets_m(day))


@dataclass(frozen=True, slots=True, eq=False)
class PreciseConstellation:
    """One system's satellites of precise orbits; column (n,) of each in them."""

    index: I64
    orbits: Orbits
    column: I64

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last GPS time of the orbits."""
        return self.orbits.span_ns

    def sample(self, middles_ns: I64, nodes_s: F64) -> tuple[F64, F64, Broadcast]:
        """See `Constellation.sample`."""
        positions, clocks, available = self.orbits.sample(middles_ns, nodes_s)
        positions, clocks = positions[:, :, self.column], clocks[:, :, self.column]
        there = available[:, self.column]
        zeros, none_m = np.zeros(there.shape, np.int64), np.zeros(there.shape)
        # Numbers without meaning are finite, as a constellation promises.
        positions = np.where(there[:, None, :, None], positions, 2.6e7)
        clocks = np.where(there[:, None], clocks, 0.0)
        ura = np.full(there.shape, PRECISE)
        broadcast = Broadcast(there, np.ones_like(there), zeros, zeros, ura, zeros, none_m, none_m)
        return positions, clocks, broadcast


def constellation(orbits: Orbits, system: int) -> PreciseConstellation:
    """The satellites of one system; none is an empty one."""
    column = np.flatnonzero(satellites.system_of(orbits.index) == system)
    return PreciseConstellation(orbits.index[column], orbits, column)
