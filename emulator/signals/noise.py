"""Thermal noise of the tracking loops, from C/N0; one function for each row of the factor registry.

Source of the formulas: Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9 (2nd ed., 5.6):
code loop early minus late, power discriminator, wide front end; Costas loop; frequency lock loop.
Errors of different epochs are independent: noise is white from epoch to epoch (modelled: loops of 0.5 Hz
and faster forget within a second). So it is right for intervals of 1 s and more; of closer epochs a real
loop repeats part of its error, and averages over them come out too good here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from emulator.factors.base import Factor
from emulator.factors.loops import CarrierNoise, CodeNoise, DopplerNoise
from emulator.signals import draws
from emulator.signals.geometry import Array
from emulator.signals.rays import Disturbance, Effect

_TWO_PI = 2 * np.pi


def code_sigma_chips(cn0_hz: Array, loop: CodeNoise) -> Array:
    """1 sigma of a delay lock loop [chips] by C/N0 as a ratio [Hz].

    sqrt(B D / (2 C/N0) (1 + 2 / ((2 - D) T C/N0)))
    """
    spacing = loop.correlator_spacing_chips
    squaring = 1 + 2 / ((2 - spacing) * loop.integration_s * cn0_hz)
    return np.sqrt(loop.loop_bandwidth_hz * spacing / (2 * cn0_hz) * squaring)


def carrier_sigma_rad(cn0_hz: Array, loop: CarrierNoise) -> Array:
    """1 sigma of a Costas phase lock loop [rad]: sqrt(B / C/N0 (1 + 1 / (2 T C/N0)))."""
    return np.sqrt(loop.loop_bandwidth_hz / cn0_hz * (1 + 1 / (2 * loop.integration_s * cn0_hz)))


def doppler_sigma_hz(cn0_hz: Array, loop: DopplerNoise) -> Array:
    """1 sigma of a frequency lock loop at high C/N0 [Hz]: sqrt(4 B / C/N0 (1 + 1 / (T C/N0))) / (2 pi T)."""
    squaring = 1 + 1 / (loop.integration_s * cn0_hz)
    return np.sqrt(4 * loop.loop_bandwidth_hz / cn0_hz * squaring) / (_TWO_PI * loop.integration_s)


@dataclass(frozen=True, slots=True)
class Loop:
    """How a factor enters: the observable it disturbs (a field of Noise), its slot among the draws, and
    its 1 sigma in the observable's unit from C/N0 [Hz], parameters, chip and wavelength [m]."""

    observable: str
    slot: int
    sigma: Callable[[Array, Factor, Array, Array], Array]


LOOPS: dict[str, Loop] = {
    "code_noise": Loop("range_m", 0, lambda cn0, p, chip_m, wave_m: chip_m * code_sigma_chips(cn0, p)),
    "carrier_noise": Loop(
        "phase_m", 1, lambda cn0, p, chip_m, wave_m: wave_m / _TWO_PI * carrier_sigma_rad(cn0, p)
    ),
    "doppler_noise": Loop("rate_mps", 2, lambda cn0, p, chip_m, wave_m: wave_m * doppler_sigma_hz(cn0, p)),
}
"""Factor -> loop."""


def errors(
    factors: Mapping[str, Factor], raw: Array, cn0_dbhz: Array, chip_m: Array, wave_m: Array
) -> Disturbance:
    """Errors of p channels.

    factors   loops that are noisy, by name
    raw       (p, SLOTS) words of the channels' satellites and receivers, see `draws.grid`
    """
    out = {loop.observable: np.zeros(len(cn0_dbhz)) for loop in LOOPS.values()}
    if factors and len(cn0_dbhz):
        cn0_hz = 10 ** (cn0_dbhz / 10)
        standard = draws.normal(raw)
        for name, parameters in factors.items():
            loop = LOOPS[name]
            out[loop.observable] += standard[:, loop.slot] * loop.sigma(cn0_hz, parameters, chip_m, wave_m)
    return Disturbance(**out)


def thermal(factors: Mapping[str, Factor]) -> Effect:
    """The noise of the loops among these factors."""
    noisy = {name: row for name, row in factors.items() if name in LOOPS}
    return lambda rays: errors(noisy, rays.words, rays.cn0_dbhz, rays.chip_m, rays.wave_m)
