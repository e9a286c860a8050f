"""Signals too weak for the loops are lost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.emulator.error_models.base import CraftContext, Row, Stage, VisibilityTerm
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry
from gnss_hil.emulator.signal.loops import Loops, code_sigma_chips, jitter_rad


class LossOfLock(Factor):
    """Signals too weak for the loops, by the rules of thumb of Kaplan & Hegarty, 3rd ed., 8.9.

    stress_deg, stress_chips   steady errors of the loops under the craft's motion
    """

    stress_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    stress_chips: Annotated[float, Field(ge=0, le=0.5)] = 0.0


MOST_JITTER_RAD = np.deg2rad(45.0)
"""Three sigma of a Costas loop's phase, and its steady error, that it still holds."""


def holds(parameters: LossOfLock, loops: Loops, cn0_dbhz: F64) -> Bool:
    """Whether both loops hold signals of this C/N0, any shape.

    Carrier: 3 sigma of all jitter and the steady error stay within 45 deg. Code: 3 sigma and the steady error
    stay within half the spacing of the correlators.
    """
    cn0_hz = 10 ** (cn0_dbhz / 10)
    phase = 3 * jitter_rad(loops, cn0_hz) + np.deg2rad(parameters.stress_deg) <= MOST_JITTER_RAD
    chips = 3 * code_sigma_chips(cn0_hz, loops) + parameters.stress_chips
    return phase & (chips <= loops.correlator_spacing_chips / 2)


@dataclass(frozen=True, slots=True)
class Model:
    params: LossOfLock
    loops: Loops

    def block(self, at: EpochGeometry) -> VisibilityTerm:
        return VisibilityTerm(holds=self._holds)

    def _holds(self, cn0_dbhz: F64) -> Bool:
        # What is hidden has no level at all; the loops' formulas begin at 0 dBHz, which no loop holds.
        return holds(self.params, self.loops, np.maximum(cn0_dbhz, 0.0))


def build(params: LossOfLock, context: CraftContext) -> Model:
    return Model(params, context.loops)


ROW = Row(
    "loss_of_lock",
    LossOfLock,
    Stage.VISIBILITY,
    "Kaplan & Hegarty, 3rd ed., 8.9: rules of thumb of PLL and DLL",
    build,
    shows="STATUS",
)
