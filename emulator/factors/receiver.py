"""Parameters of the receivers' errors.

Formulas stand in `emulator.signals.oscillator`, `.slips`, `.windup`, `.biases` and
`emulator.receivers.collection`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from emulator.factors.base import Factor


class ClockInstability(Factor):
    """Free oscillators in place of the bounded wander, one for each clock domain.

    oscillator     class: see `emulator.signals.oscillator.OSCILLATORS`
    offset_ms      1 sigma of the time error at the start (modelled)
    frequency_ppb  1 sigma of the frequency error at the start, 1e-9 (modelled)
    reset_ms       a clock more than half of this off is set back by it; 0: never
    """

    oscillator: Literal["tcxo-low", "tcxo", "ocxo", "csac", "rb"] = "tcxo"
    offset_ms: Annotated[float, Field(ge=0, le=10)] = 0.1
    frequency_ppb: Annotated[float, Field(ge=0, le=2000)] = 20.0
    reset_ms: Annotated[float, Field(ge=0, le=100)] = 0.0
