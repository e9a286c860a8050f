"""The policies: who assigns satellites to antennas, and how the measurements become a fix.

Four rows, those that RU 2706636 C1 is compared with and its own; docs/patent.md has them side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.registry import table
from gnss_hil.flightsw.assignment import patent
from gnss_hil.flightsw.assignment.options import Options
from gnss_hil.flightsw.estimation.all_in_view import together
from gnss_hil.flightsw.estimation.best_antenna import single
from gnss_hil.flightsw.estimation.fix_inputs import Circumstances
from gnss_hil.flightsw.estimation.position import Fix, NoFix
from gnss_hil.flightsw.estimation.receiver_mean import averaged
from gnss_hil.flightsw.measurement.observables import Ranges

Assign = Callable[[NDArray, NDArray, NDArray, NDArray, NDArray, Options], NDArray[np.int64]]
Combine = Callable[[Ranges, Circumstances], tuple[Fix | NoFix, int]]


@dataclass(frozen=True, slots=True)
class Policy:
    """assign is None where the receivers choose for themselves: no commands are sent.

    combine makes the fix of the ranges and says which antenna leads from now on, -1 none.
    """

    name: str
    options: type[Options]
    assign: Assign | None
    combine: Combine
    source: str
    summary: str


POLICIES = table(
    Policy(
        "patent",
        patent.PatentOptions,
        patent.assign,
        together,
        "RU 2706636 C1, claim 1, steps 6 to 9",
        "each satellite on the one antenna whose axis is nearest",
    ),
    Policy(
        "prototype",
        Options,
        None,
        together,
        "RU 2654321, as described in RU 2706636 C1",
        "every receiver picks its own satellites; all ranges reduced to the centre of mass, solved together",
    ),
    Policy(
        "analogue",
        Options,
        None,
        averaged,
        "SIGI on the US segment of the ISS, as described in RU 2706636 C1",
        "every receiver solves alone, the solutions are averaged: mean place of the antennas, no lever arms",
    ),
    Policy(
        "single",
        Options,
        None,
        single,
        "practice of ASN-M on the ISS (Mikhailov, Larkov, 2011)",
        "the antenna that sees most satellites, alone: its own place, which jumps where another takes over",
    ),
)


def policy(name: str) -> Policy:
    """The policy of this name; ValueError lists those there are."""
    if name not in POLICIES:
        raise ValueError(f"policy '{name}': not known; there are {', '.join(POLICIES)}")
    return POLICIES[name]
