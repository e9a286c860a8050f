"""What a block of frames says: records of one epoch, as the bus delivers them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.messages import MAX_RECEIVERS


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

    quaternion_body_from_ecef: NDArray[np.float64]
    rate_body_rps: NDArray[np.float64]


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

    receiver: NDArray[np.int64]
    channel: NDArray[np.int64]
    sat: NDArray[np.int64]
    pseudorange_m: NDArray[np.float64]
    range_rate_mps: NDArray[np.float64]
    cn0_dbhz: NDArray[np.float64]
    lock: NDArray[np.float64]
    health: NDArray[np.float64]
    ura: NDArray[np.float64]
    pos_sv_m: NDArray[np.float64]
    vel_sv_mps: NDArray[np.float64]
    clock_m: NDArray[np.float64]
    clock_drift_mps: NDArray[np.float64]
    signal: NDArray[np.int64]
    frequency: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.sat)

    def __getitem__(self, rows) -> Measurements:
        return Measurements(*(getattr(self, name)[..., rows] for name in self.__slots__))

    def where(self, which: NDArray[np.bool_]) -> Measurements:
        """The rows that `which` (n,) marks."""
        return self if which.all() else self[which]


@dataclass(frozen=True, slots=True)
class AlmanacRows:
    """Predictions of this epoch: sat (n,), pos_ecef_m and vel_ecef_mps (n, 3), healthy (n,) bool."""

    sat: NDArray[np.int64]
    pos_ecef_m: NDArray[np.float64]
    vel_ecef_mps: NDArray[np.float64]
    healthy: NDArray[np.bool_]

    def where(self, which: NDArray[np.bool_]) -> AlmanacRows:
        """The rows that `which` (n,) marks."""
        if which.all():
            return self
        return AlmanacRows(*(getattr(self, name)[which] for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class Acks:
    """Answers to commands: receiver, channel, result, sat, transaction, each (n,) int."""

    receiver: NDArray[np.int64]
    channel: NDArray[np.int64]
    result: NDArray[np.int64]
    sat: NDArray[np.int64]
    transaction: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Epoch:
    """All that a block of frames says.

    boots       (MAX_RECEIVERS,) boot count of each receiver, -1 where its tag, status or heartbeat is missing
    domains     (MAX_RECEIVERS,) clock domain it names, likewise
    lost        frames missing by the counters
    """

    mark: Mark | None
    attitude: AttitudeReport | None
    measurements: Measurements
    almanac: AlmanacRows
    acks: Acks
    boots: NDArray[np.int64]
    domains: NDArray[np.int64]
    lost: int


def nothing(lost: int = 0) -> Epoch:
    """An epoch without a time mark: nothing in it is used."""
    none, nowhere = np.zeros(0), np.zeros(0, np.int64)
    three = np.zeros((3, 0))
    silent = np.full(MAX_RECEIVERS, -1, np.int64)
    measurements = Measurements(
        receiver=nowhere, channel=nowhere, sat=nowhere, signal=nowhere, frequency=none,
        pseudorange_m=none, range_rate_mps=none, cn0_dbhz=none, lock=none, health=none, ura=none,
        pos_sv_m=three, vel_sv_mps=three, clock_m=none, clock_drift_mps=none,
    )  # fmt: skip
    return Epoch(
        mark=None,
        attitude=None,
        measurements=measurements,
        almanac=AlmanacRows(nowhere, three.T, three.T, none > 0),
        acks=Acks(nowhere, nowhere, nowhere, nowhere, nowhere),
        boots=silent,
        domains=silent,
        lost=lost,
    )
