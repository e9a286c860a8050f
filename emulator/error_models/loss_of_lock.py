"""Signals too weak for the loops are lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import F64, Bool
from gnss_hil.emulator.error_models.base import Context, ErrorModel, Row, Stage, VisibilityTerm
from gnss_hil.emulator.error_models.params_receiver import LossOfLock
from gnss_hil.emulator.signal.epoch_geometry import EpochGeometry
from gnss_hil.emulator.signal.loops import Loops
from gnss_hil.emulator.signal.tracking_loss import holds


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    params: LossOfLock
    loops: Loops

    def visibility(self, at: EpochGeometry) -> VisibilityTerm:
        return VisibilityTerm(holds=self._holds)

    def _holds(self, cn0_dbhz: F64) -> Bool:
        # What is hidden has no level at all; the loops' formulas begin at 0 dBHz, which no loop holds.
        return holds(self.params, self.loops, np.maximum(cn0_dbhz, 0.0))


def build(params: LossOfLock, context: Context) -> ErrorModel:
    return Model(params, context.loops)


ROW = Row(
    "loss_of_lock",
    LossOfLock,
    Stage.VISIBILITY,
    "Kaplan & Hegarty, 3rd ed., 8.9: rules of thumb of PLL and DLL",
    build,
    shows="STATUS",
)
