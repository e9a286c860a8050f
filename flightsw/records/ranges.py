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
    ura                      (n,) accuracy index
    pseudorange_m, range_rate_mps, pos_sv_m, vel_sv_mps, clock_m, clock_drift_mps
                             as in `gnss_hil.flightsw.records.epoch.Measurements`
    code_variance_m2, rate_variance_m2ps2   (n,) noise of pseudorange and range rate
    """

    receiver: I64
    sat: I64
    channels: I64
    ura: F64
    pseudorange_m: F64
    range_rate_mps: F64
    pos_sv_m: F64
    vel_sv_mps: F64
    clock_m: F64
    clock_drift_mps: F64
    code_variance_m2: F64
    rate_variance_m2ps2: F64

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
