"""Noise of a receiver's loops by C/N0, signal by signal, and what its antenna receives besides.

Variances of the delay lock loop (early minus late power) and of the frequency lock loop, with the figures
that the vehicle file has of the receivers. A codeless receiver tracks the encrypted code with the carrier's
help, and no formula has its loop: such signals have a figure of their own. Reflections err by a share of a
chip.

Source: Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., 8.9 (2nd ed., 5.6)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import signals
from gnss_hil.dbc.common.arrays import F64, I64
from gnss_hil.dbc.common.signals import SIGNALS
from gnss_hil.dbc.common.vehicle import ReceiverFigures
from gnss_hil.flightsw.measurement.signals import carrier_hz
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS

_CHIP_M: F64 = np.nan_to_num(LIGHT_MPS / signals.column(lambda signal: signal.chip_hz, np.nan), nan=300.0)
"""(16,) by signal: length of a chip [m]; of what is no signal, long."""

_SHARE_OF_CHIP: F64 = _CHIP_M / _CHIP_M[SIGNALS["L1CA"].value]
_NUMBERED = signals.column(lambda signal: signal.spacing_hz != 0, False)
_SECOND = signals.beyond_first() > 0
_TWO_PI = 2 * np.pi

_45_DBHZ = 10**4.5


@dataclass(frozen=True, slots=True, eq=False)
class ReceiverNoise:
    """Of pseudoranges, (16,) by signal, and of range rates.

    loop_m2hz     variance of the loop times C/N0;  squaring_hz  C/N0 at which squaring doubles it
    lasting_m2    variance that no C/N0 takes away
    rate_hz3      variance of the frequency lock loop times C/N0 [Hz^3];  mixing_hz  where squaring doubles it
    """

    loop_m2hz: F64
    squaring_hz: float
    lasting_m2: F64
    rate_hz3: float
    mixing_hz: float

    def code_variance_m2(self, cn0_hz: F64, signal: I64) -> F64:
        """(n,) of pseudoranges of signals (n,) with C/N0 (n,) as a ratio."""
        return self.loop_m2hz[signal] / cn0_hz * (1 + self.squaring_hz / cn0_hz) + self.lasting_m2[signal]

    def rate_variance_m2ps2(self, cn0_hz: F64, signal: I64, frequency: F64) -> F64:
        """(n,) of range rates, with frequency numbers (n,)."""
        wave_m = LIGHT_MPS / carrier_hz(signal, frequency)
        return wave_m**2 * (self.rate_hz3 / cn0_hz * (1 + self.mixing_hz / cn0_hz))


def receiver_noise(figures: ReceiverFigures) -> ReceiverNoise:
    """By the figures of a vehicle file."""
    spacing, integration = figures.correlator_spacing_chips, figures.integration_s
    loop_m2hz = figures.code_bandwidth_hz * spacing / 2 * _CHIP_M**2
    for name, sigma_m in figures.code_noise_m.items():
        loop_m2hz[SIGNALS[name].value] = sigma_m**2 * _45_DBHZ
    return ReceiverNoise(
        loop_m2hz,
        2 / ((2 - spacing) * integration),
        (figures.multipath_m * _SHARE_OF_CHIP) ** 2
        + _NUMBERED * figures.channel_delay_m**2
        + _SECOND * figures.band_delay_m**2,
        4 * figures.frequency_bandwidth_hz / (_TWO_PI * integration) ** 2,
        1 / integration,
    )
