"""Records of one epoch, as the bus delivers them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.dbc.common.limits import MAX_RECEIVERS


@dataclass(frozen=True, slots=True)
class Mark:
    """The time mark: when all receivers latched.

    clock   0: t_ns is GPS time; k + 1: it is what the clock of domain k showed
    """

    session: int
    epoch: int
    t_ns: int
    leap: int
    clock: int = 0


@dataclass(frozen=True, slots=True)
class AttitudeReport:
    """Attitude at the time mark.

    quaternion_body_from_ecef   (4,) scalar first, Hamilton, passive, normalised
    rate_body_rps               (3,) relative to inertial space
    """

    quaternion_body_from_ecef: F64
    rate_body_rps: F64


@dataclass(frozen=True, slots=True)
class Measurements:
    """Complete channels of an epoch, one row each, ordered by receiver and channel.

    receiver, channel, sat   (n,) int: 0-based receiver (= antenna), channel, satellite index
    pseudorange_m            (n,) raw clocks, at the antenna's phase centre
    range_rate_mps           (n,) dP/dt by GPS time
    cn0_dbhz, lock, health, ura   (n,)
    signal                   (n,) int: number of the contract's table "Signal"
    frequency                (n,) GLONASS frequency number
    pos_sv_m, vel_sv_mps     (3, n) ECEF of the transmission instant
    clock_m, clock_drift_mps (n,) satellite clock, to be added to the pseudorange, and its rate
    """

    receiver: I64
    channel: I64
    sat: I64
    pseudorange_m: F64
    range_rate_mps: F64
    cn0_dbhz: F64
    lock: F64
    health: F64
    ura: F64
    pos_sv_m: F64
    vel_sv_mps: F64
    clock_m: F64
    clock_drift_mps: F64
    signal: I64
    frequency: F64

    def __len__(self) -> int:
        return len(self.sat)

    def __getitem__(self, rows) -> Measurements:
        return Measurements(*(getattr(self, name)[..., rows] for name in self.__slots__))

    def where(self, which: Bool) -> Measurements:
        """The rows that `which` (n,) marks."""
        return self if which.all() else self[which]


@dataclass(frozen=True, slots=True)
class AlmanacRows:
    """Predictions of this epoch: sat (n,), pos_ecef_m and vel_ecef_mps (3, n), healthy (n,) bool."""

    sat: I64
    pos_ecef_m: F64
    vel_ecef_mps: F64
    healthy: Bool

    def where(self, which: Bool) -> AlmanacRows:
        """The rows that `which` (n,) marks."""
        if which.all():
            return self
        return AlmanacRows(*(getattr(self, name).compress(which, axis=-1) for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class Acks:
    """Answers to commands: receiver, channel, result, sat, transaction, each (n,) int."""

    receiver: I64
    channel: I64
    result: I64
    sat: I64
    transaction: I64

    def __len__(self) -> int:
        return len(self.sat)

    def __getitem__(self, rows) -> Acks:
        return Acks(*(getattr(self, name)[rows] for name in self.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """The ionosphere as satellites broadcast it: alpha, beta (4,) [s, s/semicircle, ...].

    Source: IS-GPS-200, 20.3.3.5.1.7
    """

    alpha: F64
    beta: F64


@dataclass(frozen=True, slots=True)
class Epoch:
    """All records of a block of frames.

    ionosphere  None where receivers report none

    boots       (MAX_RECEIVERS,) boot count of each receiver, -1 where its tag, status or heartbeat is missing
    domains     (MAX_RECEIVERS,) clock domain it reports, likewise
    lost        frames missing by the counters
    """

    mark: Mark | None
    attitude: AttitudeReport | None
    measurements: Measurements
    almanac: AlmanacRows
    acks: Acks
    ionosphere: Coefficients | None
    boots: I64
    domains: I64
    lost: int


_NONE, _NO_INDEX, _NO_VECTOR = np.zeros(0), np.zeros(0, np.int64), np.zeros((3, 0))
_NONE_REPORTED = np.full(MAX_RECEIVERS, -1, np.int64)
for _shared in (_NONE, _NO_INDEX, _NO_VECTOR, _NONE_REPORTED):
    _shared.setflags(write=False)

NO_MEASUREMENTS = Measurements(
    receiver=_NO_INDEX, channel=_NO_INDEX, sat=_NO_INDEX, signal=_NO_INDEX, frequency=_NONE,
    pseudorange_m=_NONE, range_rate_mps=_NONE, cn0_dbhz=_NONE, lock=_NONE, health=_NONE, ura=_NONE,
    pos_sv_m=_NO_VECTOR, vel_sv_mps=_NO_VECTOR, clock_m=_NONE, clock_drift_mps=_NONE,
)  # fmt: skip
NO_ALMANAC = AlmanacRows(_NO_INDEX, _NO_VECTOR, _NO_VECTOR, _NONE > 0)
NO_ACKS = Acks(_NO_INDEX, _NO_INDEX, _NO_INDEX, _NO_INDEX, _NO_INDEX)


def empty_epoch(lost: int = 0) -> Epoch:
    """An epoch without a time mark: nothing in it is used."""
    return Epoch(
        mark=None,
        attitude=None,
        measurements=NO_MEASUREMENTS,
        almanac=NO_ALMANAC,
        acks=NO_ACKS,
        ionosphere=None,
        boots=_NONE_REPORTED,
        domains=_NONE_REPORTED,
        lost=lost,
    )
