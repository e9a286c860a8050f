"""Kinds of measurement beside ranges, one row each: what forms one from an epoch's records.

Ranges are not in this table: every navigator takes them, and makes code ranges and range rates of them, for
whose clocks and rays its own state stands. A row here is a kind that is predicted from a point of the state
space alone: a star tracker's, a peer's. A navigator without a use for a kind leaves it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gnss_hil.flightsw.measurement.base import Measurement
from gnss_hil.flightsw.records.epoch import Epoch


@dataclass(frozen=True, slots=True)
class MeasurementRow:
    """form: the measurements of this kind in an epoch's records, None where it brought none."""

    name: str
    form: Callable[[Epoch], Measurement | None]
    source: str


OTHER_KINDS: dict[str, MeasurementRow] = {}
"""By name, in the order in which navigators get them. The contract has no node yet whose frames make one."""


def other_measurements(epoch: Epoch) -> tuple[Measurement, ...]:
    """Of all kinds in the table, those that this epoch brought."""
    formed = [row.form(epoch) for row in OTHER_KINDS.values()]
    return tuple(z for z in formed if z is not None)
