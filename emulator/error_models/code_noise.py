"""Thermal noise of the delay lock loop."""

from __future__ import annotations

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.error_models import loop_noise
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.channel_geometry import ChannelGeometry
from gnss_hil.emulator.signal.loops import Loops, code_sigma_chips


class CodeNoise(Factor):
    """Thermal noise of the delay lock loop, non-coherent; no parameters but the loop's."""


def sigma_m(at: ChannelGeometry, cn0_hz: F64, loops: Loops) -> F64:
    return at.chip_m * code_sigma_chips(cn0_hz, loops)


ROW = loop_noise.row("code_noise", CodeNoise, "range_m", sigma_m, "DLL", shows="RANGE")
