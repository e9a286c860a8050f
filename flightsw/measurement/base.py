"""What an estimator asks of measurements, whatever they are: ranges, range rates, later sights of stars and
ranges to other craft.

A kind of measurement is a set of n values with the model that predicts them at a point of the state space.
Estimators know kinds by this protocol alone; which unknowns a kind's Jacobian is by, it states itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from gnss_hil.dbc.common.arrays import F64


class Unknown(Enum):
    """Blocks of the state vector."""

    POSITION = "position [m], ECEF"
    VELOCITY = "velocity [m/s], ECEF"
    CLOCK = "clocks and time offsets of systems [m]"
    DRIFT = "their rates [m/s]"


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A point of the state space where measurements are predicted; None stands for zeros.

    position_m, velocity_mps   (3,) ECEF
    clock_m, drift_mps         (c,)
    """

    position_m: F64
    velocity_mps: F64 | None = None
    clock_m: F64 | None = None
    drift_mps: F64 | None = None


class Measurement(Protocol):
    """n measurements of one kind.

    kind       its name
    unknowns   blocks that the Jacobian's columns are by, in their order
    value      (n,) as measured, with what the satellites report of their own clocks added
    variance   (n,)
    """

    @property
    def kind(self) -> str: ...
    @property
    def unknowns(self) -> tuple[Unknown, ...]: ...
    @property
    def value(self) -> F64: ...
    @property
    def variance(self) -> F64: ...

    def predict(self, x: Point) -> F64:
        """(n,) values that would be measured at x."""
        ...

    def jacobian(self, x: Point) -> F64:
        """(n, u) change of the prediction at x with each unknown."""
        ...
