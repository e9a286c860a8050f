"""What a fix is made of: one range for each antenna and satellite."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """One row for each antenna and satellite.

    receiver, sat            (n,) int: 0-based receiver (= antenna), satellite index
    channels                 (n,) int: bit k, channel k of the receiver delivered it
    pseudorange_m, range_rate_mps, pos_sv_m, vel_sv_mps, clock_m, clock_drift_mps
                             as in `gnss_hil.flightsw.records.epoch.Measurements`
    code_variance_m2, rate_variance_m2ps2   (n,) of what errs from range to range: noise, reflections
    sat_rate_sigma_mps       (n,) 1 sigma of what range rates of its satellite have in common: that of its
                             clock, and of a delay followed from epoch to epoch
    space_sigma_m            (n,) 1 sigma of the orbit and clock that the satellite reports, in its direction
    code_bias_sigma_m        (n,) 1 sigma of its code's delay against the code that the clock belongs to
    followed_sigma_m         (n,) 1 sigma of a followed delay taken out of all ranges of its satellite, or 0
    electrons                (n,) ionospheric delay in the pseudorange over that of the first signal of the
                             reference system on the same ray; 0 where two signals have cancelled it
    """

    receiver: I64
    sat: I64
    channels: I64
    pseudorange_m: F64
    range_rate_mps: F64
    pos_sv_m: F64
    vel_sv_mps: F64
    clock_m: F64
    clock_drift_mps: F64
    code_variance_m2: F64
    rate_variance_m2ps2: F64
    sat_rate_sigma_mps: F64
    space_sigma_m: F64
    code_bias_sigma_m: F64
    followed_sigma_m: F64
    electrons: F64

    def __len__(self) -> int:
        return len(self.sat)

    @property
    def satellites(self) -> int:
        """How many there are."""
        return distinct(self.sat)

    def __getitem__(self, rows) -> Ranges:
        return Ranges(*(getattr(self, name)[..., rows] for name in self.__slots__))


def distinct(numbers: I64) -> int:
    """How many different ones there are among numbers (n,)."""
    return _distinct(numbers.tobytes())


@lru_cache(maxsize=64)
def _distinct(numbers: bytes) -> int:
    """Most epochs measure the same satellites as the one before."""
    return len(set(np.frombuffer(numbers, np.int64).tolist()))
