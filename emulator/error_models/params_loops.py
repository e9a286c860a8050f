"""The receivers' tracking loops, and the factors that are their thermal noise.

All that loops do, noise, slips, loss of lock and what reflections do to them, is of the same loops. Formulas
stand in `emulator.error_models.thermal_noise`, `.slips` and `.multipath`.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.emulator.error_models.base import Factor


class Loops(Strict):
    """Of every channel: a delay lock loop, early minus late; a phase lock loop; a frequency lock loop.

    ..._bandwidth_hz          one-sided noise bandwidths
    correlator_spacing_chips  early to late
    integration_s             before the discriminators
    other_jitter_deg          1 sigma of what shakes the phase lock beside noise: vibration, oscillator. It
                              counts for slips and loss of lock (modelled)
    """

    code_bandwidth_hz: Annotated[float, Field(gt=0, le=50)] = 0.5
    carrier_bandwidth_hz: Annotated[float, Field(gt=0, le=100)] = 15.0
    frequency_bandwidth_hz: Annotated[float, Field(gt=0, le=100)] = 2.0
    correlator_spacing_chips: Annotated[float, Field(ge=0.05, le=1)] = 0.5
    integration_s: Annotated[float, Field(gt=0, le=1)] = 0.02
    other_jitter_deg: Annotated[float, Field(ge=0, le=45)] = 2.0


class CodeNoise(Factor):
    """Thermal noise of the delay lock loop, non-coherent; no parameters but the loop's."""


class CarrierNoise(Factor):
    """Thermal noise of the phase lock loop, a Costas loop; no parameters but the loop's."""


class DopplerNoise(Factor):
    """Thermal noise of the frequency lock loop; no parameters but the loop's."""
