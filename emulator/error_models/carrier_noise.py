"""Thermal noise of the phase lock loop, a Costas loop."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models import loop_noise
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, carrier_sigma_rad


class CarrierNoise(Factor):
    """Thermal noise of the phase lock loop, a Costas loop; no parameters but the loop's."""


def sigma_m(at: ChannelGeometry, cn0_hz: F64, loops: Loops) -> F64:
    return at.wave_m / (2 * np.pi) * carrier_sigma_rad(cn0_hz, loops)


ROW = loop_noise.row("carrier_noise", CarrierNoise, "phase_m", sigma_m, "PLL", shows="PHASE")
