"""Ranging signals the emulated receivers know: one row for each.

Adding a signal is adding a row; everything that depends on the signal reads this table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.messages import VALUES
from gnss_hil.emulator.constellation.base import ORBIT_RADIUS_M
from gnss_hil.emulator.earth.constants import EQUATORIAL_RADIUS_M, LIGHT_MPS

SIGNAL = {label: raw for raw, label in VALUES["Signal"].items()}

_SYSTEMS = satellites.SATELLITES // satellites.NUMBERS

L1_HZ = 1_575.42e6
"""Carrier of GPS. IS-GPS-200, 3.3.1.1."""

G1_HZ, G1_STEP_HZ = 1_602.0e6, 562.5e3
"""Carrier of GLONASS's frequency number 0 and step of one number. GLONASS ICD 5.1 (2008), 3.3.1.1."""

LOWEST_RAD = np.deg2rad(5.0)
"""Elevation for which both interface documents promise a power."""


@dataclass(frozen=True, slots=True)
class Band:
    """One signal.

    carrier_hz    carrier of frequency number 0 [Hz]
    spacing_hz    carrier step of one frequency number [Hz]
    chip_hz       chipping rate of the ranging code [1/s]
    received_dbw  least power an isotropic circularly polarised antenna on the ground receives from a
                  satellite 5 deg high [dBW]. Both documents give it for a 3 dBi linearly polarised one,
                  which takes half of a circular wave: the same number
    radius_m      radius of the system's orbits, which fixes the distance that power belongs to [m]
    """

    system: int
    signal: str
    carrier_hz: float
    spacing_hz: float
    chip_hz: float
    received_dbw: float
    radius_m: float
    source: str


BANDS = (
    Band(satellites.GPS, "L1CA", L1_HZ, 0.0, 1.023e6, -158.5, ORBIT_RADIUS_M[satellites.GPS],
         "IS-GPS-200, 3.3.1.1, 3.2.1.3 and table 3-Va"),
    Band(satellites.GLONASS, "L1OF", G1_HZ, G1_STEP_HZ, 0.511e6, -161.0, ORBIT_RADIUS_M[satellites.GLONASS],
         "GLONASS ICD 5.1 (2008), 3.3.1.1, 3.3.1.4 and 3.3.1.6"),
)  # fmt: skip


def slant_range_m(radius_m: float) -> float:
    """Distance [m] from a place on the Earth to a satellite at radius_m that stands 5 deg high there."""
    across = EQUATORIAL_RADIUS_M * np.cos(LOWEST_RAD)
    return float(np.sqrt(radius_m**2 - across**2) - EQUATORIAL_RADIUS_M * np.sin(LOWEST_RAD))


def edge_off_nadir_rad(radius_m: float) -> float:
    """Angle off nadir [rad] at which that satellite sees that place."""
    return float(np.arcsin(EQUATORIAL_RADIUS_M * np.cos(LOWEST_RAD) / radius_m))


def band_of(system: int) -> Band:
    """The first band of a system."""
    return next(band for band in BANDS if band.system == system)


@dataclass(frozen=True, slots=True, eq=False)
class BandTable:
    """The first band of every system, as columns (8,) over systems; signal -1 and nan where there is none.

    signal      value of the contract's table "Signal"
    carrier_hz, spacing_hz   see Band
    chip_m      length of a code chip [m]
    power_dbwm2 received power of an isotropic antenna times distance squared [dB(W m^2)]
    """

    signal: NDArray[np.int64]
    carrier_hz: NDArray[np.float64]
    spacing_hz: NDArray[np.float64]
    chip_m: NDArray[np.float64]
    power_dbwm2: NDArray[np.float64]


def _table(bands: tuple[Band, ...]) -> BandTable:
    signal = np.full(_SYSTEMS, -1)
    columns = np.full((4, _SYSTEMS), np.nan)
    for band in bands:
        if signal[band.system] >= 0:
            raise ValueError(f"two first bands for system {band.system}")
        signal[band.system] = SIGNAL[band.signal]
        power = band.received_dbw + 20 * np.log10(slant_range_m(band.radius_m))
        columns[:, band.system] = band.carrier_hz, band.spacing_hz, LIGHT_MPS / band.chip_hz, power
    return BandTable(signal, *columns)


BY_SYSTEM = _table(BANDS)


def wavelength_m(system: NDArray[np.int64], frequency: NDArray[np.int64]) -> NDArray[np.float64]:
    """Carrier wavelengths (p,) [m] of satellites (p,) with these GLONASS frequency numbers (0 elsewhere)."""
    return LIGHT_MPS / (BY_SYSTEM.carrier_hz[system] + frequency * BY_SYSTEM.spacing_hz[system])
