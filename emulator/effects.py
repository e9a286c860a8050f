"""From the factors of a scenario to what acts on measured signals: a table of makers by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from emulator.factors.base import Factor
from emulator.signals import noise
from emulator.signals.rays import Effect

Maker = Callable[[Factor], Effect]

MAKERS: dict[str, Maker] = {}
"""Factor -> maker of its effect. Loop noise is not among them: its rows share one draw."""


def build_effects(factors: Mapping[str, Factor]) -> tuple[Effect, ...]:
    """Effects of the factors of a craft that are on."""
    loops = (noise.thermal(factors),) if noise.LOOPS.keys() & factors.keys() else ()
    return loops + tuple(MAKERS[name](row) for name, row in factors.items() if name in MAKERS)
