"""Ranging signals that emulated satellites transmit, as columns over their values on the bus.

Carriers, chips and numbers are those of the contract's table (`gnss_hil.dbc.common.signals`), powers those
of `gnss_hil.emulator.signal.powers`. Which satellite transmits which: `gnss_hil.emulator.signal.carriers`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import signals, systems
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


@dataclass(frozen=True, slots=True, eq=False)
class BandTable:
    """Transmitted signals as columns (16,) over values of the contract's table "Signal"; nan where there is
    none.

    carrier_hz  of frequency number 0;  spacing_hz  step of one frequency number [Hz]
    chip_m      length of a code chip [m]
    power_dbwm2 received power of an isotropic antenna times distance squared [dB(W m^2)]
    """

    carrier_hz: F64
    spacing_hz: F64
    chip_m: F64
    power_dbwm2: F64


def _table(bands: tuple[Band, ...]) -> BandTable:
    columns = np.full((4, signals.COUNT), np.nan)
    for band in bands:
        power = band.received_dbw + 20 * np.log10(slant_range_m(band.radius_m))
        columns[:, band.signal.value] = (
            band.signal.carrier_hz, band.signal.spacing_hz, LIGHT_MPS / band.signal.chip_hz, power,
        )  # fmt: skip
    return BandTable(*columns)


def _firsts(bands: tuple[Band, ...]) -> I64:
    found = np.full(systems.COUNT, -1)
    for band in reversed(bands):
        found[band.system.value] = band.signal.value
    return found


BY_SIGNAL = _table(BANDS)
FIRST_SIGNAL = _firsts(BANDS)
"""(8,) value of each system's preferred signal; -1 of a system that transmits none."""


def wavelength_m(signal: I64, frequency: I64) -> F64:
    """Carrier wavelengths (p,) [m] of signals (p,), by their values on the bus, with frequency numbers
    (p,)."""
    return LIGHT_MPS / (BY_SIGNAL.carrier_hz[signal] + frequency * BY_SIGNAL.spacing_hz[signal])
