"""Ranging signals that emulated satellites transmit, as columns over systems.

Carriers, chips and numbers are those of the contract's table (`gnss_hil.dbc.common.signals`), powers those
of `gnss_hil.emulator.signal.powers`. Emulated receivers track one signal of each system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import systems
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.signals import SIGNALS, Signal
from gnss_hil.dbc.common.systems import SYSTEMS, System
from gnss_hil.emulator.earth.constants import EQUATORIAL_RADIUS_M, LIGHT_MPS
from gnss_hil.emulator.signal.powers import POWERS

L1_HZ = SIGNALS["L1CA"].carrier_hz
"""Carrier of L1, for which contents of electrons and conductivities are converted."""

LOWEST_RAD = np.deg2rad(5.0)
"""Elevation for which interface documents promise a power."""


@dataclass(frozen=True, slots=True)
class Band:
    """One transmitted signal and the distance that its least power belongs to: the orbit's radius [m]."""

    signal: Signal
    system: System
    received_dbw: float

    @property
    def radius_m(self) -> float:
        return self.system.orbit_radius_m


BANDS = tuple(
    Band(SIGNALS[name], SYSTEMS[SIGNALS[name].system], power.received_dbw) for name, power in POWERS.items()
)


def slant_range_m(radius_m: float) -> float:
    """Distance [m] from a place on the Earth to a satellite at radius_m that stands 5 deg high there."""
    across = EQUATORIAL_RADIUS_M * np.cos(LOWEST_RAD)
    return float(np.sqrt(radius_m**2 - across**2) - EQUATORIAL_RADIUS_M * np.sin(LOWEST_RAD))


def edge_off_nadir_rad(radius_m: float) -> float:
    """Angle off nadir [rad] at which that satellite sees that place."""
    return float(np.arcsin(EQUATORIAL_RADIUS_M * np.cos(LOWEST_RAD) / radius_m))


def band_of(system: int) -> Band:
    """The preferred transmitted signal of a system by its value on the bus; StopIteration if it has none."""
    return next(band for band in BANDS if band.system.value == system)


@dataclass(frozen=True, slots=True, eq=False)
class BandTable:
    """The preferred signal of every system as columns (8,) over systems; -1 and nan where there is none.

    signal      value of the contract's table "Signal"
    carrier_hz  of frequency number 0;  spacing_hz  step of one frequency number [Hz]
    chip_m      length of a code chip [m]
    power_dbwm2 received power of an isotropic antenna times distance squared [dB(W m^2)]
    """

    signal: I64
    carrier_hz: F64
    spacing_hz: F64
    chip_m: F64
    power_dbwm2: F64


def _table(bands: tuple[Band, ...]) -> BandTable:
    signal = np.full(systems.COUNT, -1)
    columns = np.full((4, systems.COUNT), np.nan)
    for band in reversed(bands):
        value, power = band.system.value, band.received_dbw + 20 * np.log10(slant_range_m(band.radius_m))
        signal[value] = band.signal.value
        columns[:, value] = (
            band.signal.carrier_hz, band.signal.spacing_hz, LIGHT_MPS / band.signal.chip_hz, power,
        )  # fmt: skip
    return BandTable(signal, *columns)


BY_SYSTEM = _table(BANDS)


def wavelength_m(system: I64, frequency: I64) -> F64:
    """Carrier wavelengths (p,) [m] of the preferred signals of satellites (p,), frequency numbers (p,)."""
    return LIGHT_MPS / (BY_SYSTEM.carrier_hz[system] + frequency * BY_SYSTEM.spacing_hz[system])
