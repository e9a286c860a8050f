"""The attitude as the on-board computer knows it: gyros that drift, corrected by a star sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gnss_hil.emulator.error_models.base import AttitudeTerm, Context, Epochs, ErrorModel, Row, Stage
from gnss_hil.emulator.error_models.params_onboard import AttitudeError
from gnss_hil.emulator.numerics.walk import Walk
from gnss_hil.emulator.sensors.attitude_determination import known, sensors


@dataclass(frozen=True, slots=True)
class Model(ErrorModel):
    walk: Walk

    def attitude(self, epochs: Epochs) -> AttitudeTerm:
        states = self.walk.over(epochs.first, epochs.count)
        angle_rad, rate_rps = (
            np.stack([getattr(s, name) for s in states]) for name in ("angle_rad", "rate_rps")
        )
        return AttitudeTerm(angle_rad, rate_rps)


def build(params: AttitudeError, context: Context) -> ErrorModel:
    parts = sensors(params, context.interval_ns)
    draws = context.stream(ROW.name)
    return Model(Walk(lambda before, epoch: known(parts, before, draws, epoch)))


ROW = Row(
    "attitude_error",
    AttitudeError,
    Stage.ATTITUDE,
    "Farrenkopf, J. Guidance and Control 1 (1978) 282",
    build,
    shows="ATT_Q01",
)
