"""Thermal noise of the tracking loops, from C/N0; one function for each row of the factor registry.

Source of the formulas: Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9 (2nd ed., 5.6):
code loop early minus late, power discriminator, wide front end; Costas loop; frequency lock loop.
Errors of different epochs are independent: noise is white from epoch to epoch (modelled: loops of 0.5 Hz
and faster forget within a second). So it is right for intervals of 1 s and more; of closer epochs a real
loop repeats part of its error, and averages over them come out too good here.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from gnss_hil.emulator.error_models.params_loops import Loops
from gnss_hil.emulator.numerics import keyed_draws
from gnss_hil.emulator.signal.channel_geometry import Disturbance, Effect
from gnss_hil.emulator.signal.geometry import Array

_TWO_PI = 2 * np.pi


def code_sigma_chips(cn0_hz: Array, loops: Loops) -> Array:
    """1 sigma of a delay lock loop [chips] by C/N0 as a ratio [Hz].

    sqrt(B D / (2 C/N0) (1 + 2 / ((2 - D) T C/N0)))
    """
    spacing = loops.correlator_spacing_chips
    squaring = 1 + 2 / ((2 - spacing) * loops.integration_s * cn0_hz)
    return np.sqrt(loops.code_bandwidth_hz * spacing / (2 * cn0_hz) * squaring)


def carrier_sigma_rad(cn0_hz: Array, loops: Loops) -> Array:
    """1 sigma of a Costas phase lock loop [rad]: sqrt(B / C/N0 (1 + 1 / (2 T C/N0)))."""
    return np.sqrt(loops.carrier_bandwidth_hz / cn0_hz * (1 + 1 / (2 * loops.integration_s * cn0_hz)))


def doppler_sigma_hz(cn0_hz: Array, loops: Loops) -> Array:
    """1 sigma of a frequency lock loop at high C/N0 [Hz]: sqrt(4 B / C/N0 (1 + 1 / (T C/N0))) / (2 pi T)."""
    squaring = 1 + 1 / (loops.integration_s * cn0_hz)
    return np.sqrt(4 * loops.frequency_bandwidth_hz / cn0_hz * squaring) / (_TWO_PI * loops.integration_s)


@dataclass(frozen=True, slots=True)
class Noise:
    """How a factor enters: the observable it disturbs (a field of Disturbance), its slot among the draws, and
    its 1 sigma in the observable's unit from C/N0 [Hz], the loops, chip and wavelength [m]."""

    observable: str
    slot: int
    sigma: Callable[[Array, Loops, Array, Array], Array]


THERMAL: dict[str, Noise] = {
    "code_noise": Noise("range_m", 0, lambda cn0, p, chip_m, wave_m: chip_m * code_sigma_chips(cn0, p)),
    "carrier_noise": Noise(
        "phase_m", 1, lambda cn0, p, chip_m, wave_m: wave_m / _TWO_PI * carrier_sigma_rad(cn0, p)
    ),
    "doppler_noise": Noise("rate_mps", 2, lambda cn0, p, chip_m, wave_m: wave_m * doppler_sigma_hz(cn0, p)),
}
"""Factor -> noise."""


def errors(
    names: Collection[str], loops: Loops, raw: Array, cn0_dbhz: Array, chip_m: Array, wave_m: Array
) -> Disturbance:
    """Errors of p channels.

    names     factors that are on, of THERMAL
    raw       (p, SLOTS) words of the channels' satellites and receivers, see `draws.grid`
    """
    out = {noise.observable: np.zeros(len(cn0_dbhz)) for noise in THERMAL.values()}
    if names and len(cn0_dbhz):
        cn0_hz = 10 ** (cn0_dbhz / 10)
        standard = keyed_draws.normal(raw)
        for name in names:
            noise = THERMAL[name]
            out[noise.observable] += standard[:, noise.slot] * noise.sigma(cn0_hz, loops, chip_m, wave_m)
    return Disturbance(**out)


def thermal(names: Collection[str], loops: Loops) -> Effect:
    """The noise of these factors, of THERMAL."""
    return lambda rays: errors(names, loops, rays.words, rays.cn0_dbhz, rays.chip_m, rays.wave_m)
