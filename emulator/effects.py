"""From the factors of a scenario to what acts on measured signals: a table of makers by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from emulator.factors.base import Factor
from emulator.signals import noise
from emulator.signals.rays import Disturbance, Effect

Maker = Callable[[Factor], Effect]


def _multipath(factor: Factor) -> Effect:
    """The loops' errors, which the scene has settled."""
    return lambda rays: Disturbance(rays.reception.range_m, rays.reception.phase_m, rays.reception.rate_mps)


MAKERS: dict[str, Maker] = {"multipath": _multipath}
"""Factor -> maker of its effect. Loop noise is not among them: its rows share one draw."""


def build_effects(factors: Mapping[str, Factor]) -> tuple[Effect, ...]:
    """Effects of the factors of a craft that are on."""
    loops = (noise.thermal(factors),) if noise.LOOPS.keys() & factors.keys() else ()
    return loops + tuple(MAKERS[name](row) for name, row in factors.items() if name in MAKERS)
