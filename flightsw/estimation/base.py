"""What a navigator is: predict, update, a state of its own.

The flight step knows navigators by this protocol alone. A snapshot navigator (`estimation.snapshot`) solves
every epoch by itself and keeps where that was; a filter keeps a state vector with its covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from gnss_hil.dbc.common.arrays import F64, I64, Bool
from gnss_hil.flightsw.attitude.attitude import Attitude
from gnss_hil.flightsw.integrity.exclusion import STRICT, Rules
from gnss_hil.flightsw.measurement.base import Measurement
from gnss_hil.flightsw.measurement.budget import Budget
from gnss_hil.flightsw.measurement.ionosphere import Ionosphere
from gnss_hil.flightsw.records.ranges import Ranges
from gnss_hil.flightsw.records.solution import Solution


@dataclass(frozen=True, slots=True)
class FixInputs:
    """What an epoch's update may use beside the ranges.

    attitude           None if there is none
    lever_arm_body_m   (m, 3) antennas relative to the centre of mass
    domain             (m,) clock domain of each antenna
    budget             what ranges err by
    ionosphere         over the craft, None where there is none or none is known
    rules              what becomes of measurements that disagree
    mark_clock         which clock showed the time mark, see `gnss_hil.flightsw.records.epoch.Mark`
    mark_doubt_s       by how much the time mark may be off [s]
    restarted          (m,) receivers that have restarted since the epoch before; None: none has
    others             measurements of other kinds, see `gnss_hil.flightsw.measurement.registry`
    """

    attitude: Attitude | None
    lever_arm_body_m: F64
    domain: I64
    budget: Budget
    ionosphere: Ionosphere | None = None
    rules: Rules = STRICT
    mark_clock: int = 0
    mark_doubt_s: float = 0.0
    restarted: Bool | None = None
    others: Sequence[Measurement] = ()


S = TypeVar("S")


class Navigator(Protocol[S]):
    """From measurements to a solution, epoch by epoch; S is the state that it hands itself."""

    def initial(self) -> S:
        """Before the first measurement."""
        ...

    def predict(self, state: S, t_ns: int) -> S:
        """The state at the time mark t_ns, before its measurements."""
        ...

    def update(self, state: S, z: Ranges, inputs: FixInputs) -> tuple[S, Solution]:
        """The state after an epoch's measurements, and what is published of it.

        z       ranges: a navigator makes code ranges and range rates of them, with its own clocks and rays
        inputs  with the measurements of other kinds
        `used`, `residual_m` and `gain` of the solution are by the rows of z.
        """
        ...
