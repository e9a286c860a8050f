"""What a fix is made of: one range for each antenna and satellite, whatever channels it came on.

A receiver may deliver several signals of one satellite. Counted apart they would make two witnesses of one:
the same satellite's errors, the same ray, the same ionosphere but for a factor. So one of them stands for all
(`of_one_signal`), or two become one range without ionosphere (`flightsw.measurement.ionosphere_free`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.satellites import SATELLITES
from gnss_hil.flightsw.io.epoch import Measurements
from gnss_hil.flightsw.measurement.noise import Noise, code_variance_m2, rate_variance_m2ps2
from gnss_hil.flightsw.measurement.signals import RANK


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """One row for each antenna and satellite.

    receiver, sat            (n,) int: 0-based receiver (= antenna), satellite index
    channels                 (n,) int: bit k, channel k of the receiver delivered it
    ura                      (n,) accuracy index
    pseudorange_m, range_rate_mps, pos_sv_m, vel_sv_mps, clock_m, clock_drift_mps
                             as in `flightsw.io.epoch.Measurements`
    code_variance_m2, rate_variance_m2ps2   (n,) noise of pseudorange and range rate
    """

    receiver: NDArray[np.int64]
    sat: NDArray[np.int64]
    channels: NDArray[np.int64]
    ura: NDArray[np.float64]
    pseudorange_m: NDArray[np.float64]
    range_rate_mps: NDArray[np.float64]
    pos_sv_m: NDArray[np.float64]
    vel_sv_mps: NDArray[np.float64]
    clock_m: NDArray[np.float64]
    clock_drift_mps: NDArray[np.float64]
    code_variance_m2: NDArray[np.float64]
    rate_variance_m2ps2: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.sat)

    def __getitem__(self, rows) -> Ranges:
        return Ranges(*(getattr(self, name)[..., rows] for name in self.__slots__))


def pairs_of(m: Measurements) -> NDArray[np.int64]:
    """(n,) one number for each antenna and satellite."""
    return m.receiver * SATELLITES + m.sat


def as_they_are(m: Measurements, noise: Noise) -> Ranges:
    """Every channel a range."""
    return Ranges(
        receiver=m.receiver,
        sat=m.sat,
        channels=np.left_shift(1, m.channel),
        ura=m.ura,
        pseudorange_m=m.pseudorange_m,
        range_rate_mps=m.range_rate_mps,
        pos_sv_m=m.pos_sv_m,
        vel_sv_mps=m.vel_sv_mps,
        clock_m=m.clock_m,
        clock_drift_mps=m.clock_drift_mps,
        code_variance_m2=code_variance_m2(m.cn0_dbhz, m.sat, noise),
        rate_variance_m2ps2=rate_variance_m2ps2(m.cn0_dbhz, noise),
    )


def of_one_signal(m: Measurements, noise: Noise) -> Ranges:
    """Of several channels with one satellite on one antenna the one with the signal of first choice.

    Of equals it is the lowest channel.
    """
    pair = pairs_of(m)
    if len(set(pair.tolist())) < len(pair):
        order = np.lexsort((m.channel, RANK[m.signal], pair))
        first = np.diff(pair[order], prepend=-1) != 0
        m = m[np.sort(order[first])]
    return as_they_are(m, noise)
