"""The policies: which antenna tracks which satellite, and the navigator that goes with each by default.

Four rows, those that RU 2706636 C1 is compared with and its own; docs/patent.md has them side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.near import hint
from gnss_hil.dbc.common.registry import table
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.flightsw.assignment import nearest_boresight
from gnss_hil.flightsw.assignment.options import AssignmentOptions

Assign = Callable[[F64, F64, I64, I64, Any], I64]
"""See `assignment.nearest_boresight.assign`; the last argument are the policy's options."""


@dataclass(frozen=True, slots=True)
class Policy:
    """assign is None where the receivers choose for themselves: no commands are sent.

    options     its own options, among those of all flights and of the navigator
    navigator   by default, a row of `estimation.registry`; any other can be chosen
    """

    name: str
    options: type[Strict]
    assign: Assign | None
    navigator: str
    source: str
    summary: str


POLICIES = table(
    Policy(
        "patent",
        nearest_boresight.NearestBoresightOptions,
        nearest_boresight.assign,
        "all_in_view",
        "RU 2706636 C1, claim 1, steps 6 to 9",
        "each satellite on the one antenna whose axis is nearest",
    ),
    Policy(
        "prototype",
        AssignmentOptions,
        None,
        "all_in_view",
        "RU 2654321, as described in RU 2706636 C1",
        "every receiver picks its own satellites; all ranges reduced to the centre of mass, solved together",
    ),
    Policy(
        "analogue",
        AssignmentOptions,
        None,
        "receiver_mean",
        "SIGI on the US segment of the ISS, as described in RU 2706636 C1",
        "every receiver solves alone, the solutions are averaged: mean place of the antennas, no lever arms",
    ),
    Policy(
        "single",
        AssignmentOptions,
        None,
        "best_antenna",
        "practice of ASN-M on the ISS (Mikhailov, Larkov, 2011)",
        "the antenna that sees most satellites, alone: its own place, which jumps where another takes over",
    ),
)


def policy(name: str) -> Policy:
    """The policy of this name; ValueError lists those there are."""
    if name not in POLICIES:
        raise ValueError(f"policy '{name}': not known; there are {', '.join(POLICIES)}{hint(name, POLICIES)}")
    return POLICIES[name]
