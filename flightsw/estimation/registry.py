"""The navigators: how measurements become a solution, one row each; chosen apart from the policy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.common.registry import table
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.flightsw.estimation.all_in_view import all_in_view
from gnss_hil.flightsw.estimation.base import Navigator
from gnss_hil.flightsw.estimation.best_antenna import best_antenna
from gnss_hil.flightsw.estimation.receiver_mean import receiver_mean
from gnss_hil.flightsw.estimation.snapshot import SnapshotNavigator


@dataclass(frozen=True, slots=True, eq=False)
class NavigatorRow:
    """build     makes what the flight step calls, whose state is its own, from the options of the flight
    options   its own options, among those of all flights; with none of its own, `Strict`
    """

    name: str
    build: Callable[[Any], Navigator[Any]]
    source: str
    summary: str
    options: type[Strict] = Strict


NAVIGATORS = table(
    NavigatorRow(
        "all_in_view",
        lambda _: SnapshotNavigator(all_in_view, judged=True),
        "RU 2706636 C1, step 10; reduction to the centre of mass: RU 2654321",
        "all ranges of all antennas, reduced to the centre of mass, solved together",
    ),
    NavigatorRow(
        "receiver_mean",
        lambda _: SnapshotNavigator(receiver_mean),
        "SIGI on the US segment of the ISS, as described in RU 2706636 C1",
        "every receiver alone, the solutions averaged: mean place of the antennas, no lever arms",
    ),
    NavigatorRow(
        "best_antenna",
        lambda _: SnapshotNavigator(best_antenna),
        "practice of ASN-M on the ISS (Mikhailov, Larkov, 2011)",
        "the antenna that sees most satellites, alone: its own place, which jumps where another takes over",
    ),
)


def navigator(name: str) -> NavigatorRow:
    """The navigator of this name; ValueError lists those there are."""
    if name not in NAVIGATORS:
        raise ValueError(
            f"navigator '{name}': not known; there are {', '.join(NAVIGATORS)}{hint(name, NAVIGATORS)}"
        )
    return NAVIGATORS[name]
