"""One error factor at a time: what it does to the fix of each of two craft, and to their difference.

Every run is the same but for the factor: the same orbits, attitudes, skies and keyed draws. What is left
without any factor (the bus's rounding) is measured too, as the first row. Errors are given in two ways: where
both craft use the same satellites on the same antennas, which is what cancels in a difference, and where the
second craft is turned so that it uses others.

Source of the question: Mikhailov & Larkov, 2011, figs. 2-5 (stand MODASN-M)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnss_hil.tools.study.two_craft import Errors

Array = NDArray[np.float64]

ALONE = "none"
"""Name of the run without any factor."""


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """What a factor does: errors with both craft alike, and with the second turned."""

    factor: str
    level: Errors
    turned: Errors


def rms(vectors: Array) -> float:
    """Root mean square length of vectors (n, 3), those that are there; nan if none is."""
    squares = np.einsum("ni,ni->n", vectors, vectors)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")


def largest(vectors: Array) -> float:
    """Greatest length of vectors (n, 3); nan if none is there."""
    lengths = np.linalg.norm(vectors, axis=1)
    lengths = lengths[np.isfinite(lengths)]
    return float(lengths.max()) if len(lengths) else float("nan")


COLUMNS: Mapping[str, tuple[str, Callable[[Effect], float]]] = {
    "fix_m": ("fix, first craft, rms [m]", lambda e: rms(e.level.position_m[0])),
    "fix2_m": ("fix, second craft, rms [m]", lambda e: rms(e.level.position_m[1])),
    "fix_max_m": ("largest [m]", lambda e: largest(e.level.position_m[0])),
    "velocity_mps": ("velocity, first craft, rms [m/s]", lambda e: rms(e.level.velocity_mps[0])),
    "alike_m": ("difference, same satellites, rms [m]", lambda e: rms(e.level.difference_m[e.level.alike])),
    "cancels": (
        "fix to difference, same satellites",
        lambda e: rms(e.level.position_m[0][e.level.alike]) / rms(e.level.difference_m[e.level.alike]),
    ),
    "unlike_m": (
        "difference, other satellites, rms [m]", lambda e: rms(e.turned.difference_m[~e.turned.alike]),
    ),
    "alike_share": ("epochs with the same satellites", lambda e: float(e.level.alike.mean())),
}  # fmt: skip
"""Column -> title and figure."""


def figures(effects: Iterable[Effect]) -> list[dict[str, Any]]:
    """A row for each effect: factor, then COLUMNS."""
    return [
        {"factor": effect.factor, **{name: of(effect) for name, (_, of) in COLUMNS.items()}}
        for effect in effects
    ]
