"""Thermal noise of the frequency lock loop."""

from __future__ import annotations

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models import loop_noise
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, doppler_sigma_hz


class DopplerNoise(Factor):
    """Thermal noise of the frequency lock loop; no parameters but the loop's."""


def sigma_mps(at: ChannelGeometry, cn0_hz: F64, loops: Loops) -> F64:
    return at.wave_m * doppler_sigma_hz(cn0_hz, loops)


ROW = loop_noise.row("doppler_noise", DopplerNoise, "rate_mps", sigma_mps, "FLL", shows="RATE")
