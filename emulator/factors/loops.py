"""Parameters of the tracking loops' thermal noise; the formulas stand in `emulator.signals.noise`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from emulator.factors.base import Factor


class CodeNoise(Factor):
    """Thermal noise of a non-coherent early-minus-late delay lock loop."""

    loop_bandwidth_hz: Annotated[float, Field(gt=0, le=50)] = 0.5
    correlator_spacing_chips: Annotated[float, Field(gt=0, le=1)] = 0.5
    integration_s: Annotated[float, Field(gt=0, le=1)] = 0.02


class CarrierNoise(Factor):
    """Thermal noise of a Costas phase lock loop."""

    loop_bandwidth_hz: Annotated[float, Field(gt=0, le=100)] = 15.0
    integration_s: Annotated[float, Field(gt=0, le=1)] = 0.02


class DopplerNoise(Factor):
    """Thermal noise of a frequency lock loop."""

    loop_bandwidth_hz: Annotated[float, Field(gt=0, le=100)] = 2.0
    integration_s: Annotated[float, Field(gt=0, le=1)] = 0.02
