"""From the factors of a scenario to what acts on measured signals: a table of makers by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import signals
from gnss_hil.emulator.error_models import code_biases, thermal_noise
from gnss_hil.emulator.error_models.base import Factor
from gnss_hil.emulator.error_models.params_loops import Loops
from gnss_hil.emulator.signal.channel_geometry import Disturbance, Effect, Rays


@dataclass(frozen=True, slots=True)
class Setting:
    """Of one craft: seed of the run, key of its draws, number of its receivers, their loops."""

    seed: int
    key: int
    receivers: int
    loops: Loops


_NUMBERED = signals.has_frequency_numbers()
"""(8,) by system: whether satellites have carriers of their own."""

Maker = Callable[[Factor, Setting], Effect]


def _multipath(factor: Factor, at: Setting) -> Effect:
    """The loops' errors, which the scene has settled."""
    return lambda rays: Disturbance(rays.reception.range_m, rays.reception.phase_m, rays.reception.rate_mps)


def _interchannel(factor: Factor, at: Setting) -> Effect:
    common_m, glonass_m = code_biases.receiver_code_m(factor, at.seed, at.key, at.receivers)

    def effect(rays: Rays) -> Disturbance:
        number = rays.scene.sky.frequency[rays.row] - code_biases.FREQUENCIES[0]
        own_m = np.where(_NUMBERED[rays.system], glonass_m[rays.receiver, number], 0.0)
        return Disturbance(range_m=common_m[rays.receiver] + own_m)

    return effect


MAKERS: dict[str, Maker] = {"multipath": _multipath, "interchannel_bias": _interchannel}
"""Factor of a craft -> maker of its effect. Loop noise is not among them: its rows share one draw."""


def build_effects(factors: Mapping[str, Factor], at: Setting) -> tuple[Effect, ...]:
    """Effects of the factors of a craft that are on."""
    noisy = [name for name in thermal_noise.THERMAL if name in factors]
    loops = (thermal_noise.thermal(noisy, at.loops),) if noisy else ()
    return loops + tuple(MAKERS[name](row, at) for name, row in factors.items() if name in MAKERS)


def sky_effects(factors: Mapping[str, Factor], seed: int, index: NDArray[np.int64]) -> tuple[Effect, ...]:
    """Effects of the factors of a sky that are on, satellites (n,), but for the ionosphere's."""
    if "code_bias" not in factors:
        return ()
    code_m = code_biases.satellite_code_m(factors["code_bias"], seed, index)
    return (lambda rays: Disturbance(range_m=code_m[rays.row]),)
