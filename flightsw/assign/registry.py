"""The assignment policies: name, options, pure function, source."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc.registry import table
from flightsw.assign import patent
from flightsw.assign.options import Options

Assign = Callable[[NDArray, NDArray, NDArray, NDArray, NDArray, Options], NDArray[np.int64]]


@dataclass(frozen=True, slots=True)
class Policy:
    """assign is None where the receivers choose for themselves: no commands, all measurements in the fix."""

    name: str
    options: type[Options]
    assign: Assign | None
    source: str
    summary: str


POLICIES = table(
    Policy(
        "patent",
        patent.PatentOptions,
        patent.assign,
        "RU 2706636 C1, claim 1, steps 6 to 9",
        "each satellite on the one antenna whose axis is nearest",
    ),
    Policy(
        "prototype",
        Options,
        None,
        "RU 2654321, as described in RU 2706636 C1",
        "every receiver picks its own satellites; all ranges reduced to the centre of mass, solved together",
    ),
)


def policy(name: str) -> Policy:
    """The policy of this name; ValueError lists those there are."""
    if name not in POLICIES:
        raise ValueError(f"policy '{name}': not known; there are {', '.join(POLICIES)}")
    return POLICIES[name]
