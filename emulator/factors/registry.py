"""Error factors of the emulated receivers: one registry, one row each.

A row has a name, a parameter model, and the source of its formula. From the table come the scenario's
validation, the command line's choices and the documentation. Which pure function applies a row's
parameters stands in `emulator.signals`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from dbc.registry import table
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


@dataclass(frozen=True, slots=True)
class Row:
    name: str
    model: type[Factor]
    source: str


FACTORS = table(
    Row("code_noise", CodeNoise, "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., DLL thermal noise"),
    Row(
        "carrier_noise", CarrierNoise, "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., PLL thermal noise"
    ),
    Row(
        "doppler_noise", DopplerNoise, "Kaplan & Hegarty, Understanding GPS/GNSS, 3rd ed., FLL thermal noise"
    ),
)
