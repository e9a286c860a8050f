"""The simple link budget: carrier to noise density of every satellite at every antenna.

Transmitted power is the least the interface documents promise and equal in all directions: satellites
radiate isotropically (modelled: a craft in low orbit is inside the main lobe). Above the satellites' main
lobes, which end little beyond the Earth's edge, signals come out far too strong and satellites far too
many: this budget is for low orbits. `gnss_hil.emulator.signal.link_budget` is for all.
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.emulator.signal.bands import BY_SIGNAL

BOLTZMANN_DBWSPK = 10 * np.log10(1.380649e-23)
"""Boltzmann constant [dB(W s / K)], exact in the SI since 2019."""


def gain_dbi(cos_angle: F64, boresight_dbi: float, at_90deg_dbi: float) -> F64:
    """Gain of a receiving antenna [dBi] by the cosine of the angle off boresight.

    Falls smoothly, in dB linear in the cosine, through the two given values and on behind the antenna
    (modelled: the usual shape of a patch within 90 deg; see Kaplan & Hegarty, 3rd ed., 8.2)
    """
    return at_90deg_dbi + (boresight_dbi - at_90deg_dbi) * cos_angle


def cn0_dbhz(
    signal: I64,
    distance_m: F64,
    angle_rad: F64,
    boresight_dbi: float,
    at_90deg_dbi: float,
    noise_k: float,
) -> F64:
    """Carrier to noise density (m, n) [dBHz].

    signal, distance_m   (n,) of the satellites: signal by its value on the bus, distance [m]
    angle_rad            (m, n) off boresight
    noise_k              system noise temperature [K]
    """
    arriving_dbw = BY_SIGNAL.power_dbwm2[signal] - 20 * np.log10(distance_m)
    noise_dbwphz = BOLTZMANN_DBWSPK + 10 * np.log10(noise_k)
    return arriving_dbw - noise_dbwphz + gain_dbi(np.cos(angle_rad), boresight_dbi, at_90deg_dbi)
