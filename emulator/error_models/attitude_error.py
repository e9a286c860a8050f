"""The attitude as the on-board computer estimates it: gyros that drift, corrected by a star sensor."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, pi, sqrt
from typing import Annotated

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.emulator.attitude.determination import Sensors, after_a_fix, estimated, settled
from gnss_hil.emulator.error_models.base import AttitudeTerm, Context, Epochs, Row, Stage
from gnss_hil.emulator.error_models.params import Factor
from gnss_hil.emulator.numerics.recursion import Recursion


class AttitudeError(Factor):
    """Rate gyros, and a star sensor that corrects them. All defaults are modelled: a gyro of navigation grade
    and a sensor of some arc seconds.

    angle_walk_deg_rth      noise of the gyros' rate: angle random walk [deg / sqrt(h)]
    drift_walk_deg_h_rth    how their drift wanders: rate random walk [deg / h / sqrt(h)]
    star_interval_s         how often the star sensor reports an attitude [s]; 0: never
    star_sigma_arcsec       1 sigma of it, each axis
    initial_deg, initial_drift_deg_h   1 sigma of attitude and drift at the start, each axis, where no star
                            sensor helps; with one, filter and sensor have long settled
    """

    angle_walk_deg_rth: Annotated[float, Field(ge=0, le=10)] = 0.003
    drift_walk_deg_h_rth: Annotated[float, Field(ge=0, le=100)] = 0.005
    star_interval_s: Annotated[float, Field(ge=0, le=86400)] = 60.0
    star_sigma_arcsec: Annotated[float, Field(ge=0.001, le=36000)] = 10.0
    initial_deg: Annotated[float, Field(ge=0, le=10)] = 0.05
    initial_drift_deg_h: Annotated[float, Field(ge=0, le=100)] = 0.02


_DEG = pi / 180
_HOUR_S = 3600.0


def sensors(parameters: AttitudeError, interval_ns: int) -> Sensors:
    """Sensors of a craft; a star fix comes in every epoch, or in every second one, and so on."""
    dt_s = interval_ns / NS_PER_S
    white = (parameters.angle_walk_deg_rth * _DEG) ** 2 / _HOUR_S
    walk = (parameters.drift_walk_deg_h_rth * _DEG / _HOUR_S) ** 2 / _HOUR_S
    star_rad = parameters.star_sigma_arcsec / 3600 * _DEG
    if parameters.star_interval_s == 0:
        initial = np.diag((parameters.initial_deg * _DEG, parameters.initial_drift_deg_h * _DEG / _HOUR_S))
        return Sensors(dt_s, white, walk, inf, star_rad, 0.0, 0.0, initial)
    epochs = max(1, ceil(parameters.star_interval_s / dt_s - 1e-9))
    ratio = settled(white, walk, star_rad, epochs * dt_s)
    angle_gain, drift_gain = 1 - ratio**-2, sqrt(walk * epochs * dt_s) / (ratio * star_rad)
    after = after_a_fix(walk, star_rad, epochs * dt_s, ratio, angle_gain, drift_gain)
    return Sensors(dt_s, white, walk, epochs, star_rad, angle_gain, drift_gain, after)


@dataclass(frozen=True, slots=True)
class Model:
    states: Recursion

    def block(self, epochs: Epochs) -> AttitudeTerm:
        states = self.states.over(epochs.first, epochs.count)
        angle_rad, rate_rps = (
            np.stack([getattr(s, name) for s in states]) for name in ("angle_rad", "rate_rps")
        )
        return AttitudeTerm(angle_rad, rate_rps)


def build(params: AttitudeError, context: Context) -> Model:
    parts = sensors(params, context.interval_ns)
    draws = context.stream(ROW.name)
    return Model(Recursion(lambda before, epoch: estimated(parts, before, draws, epoch)))


ROW = Row(
    "attitude_error",
    AttitudeError,
    Stage.ATTITUDE,
    "Farrenkopf, J. Guidance and Control 1 (1978) 282",
    build,
    shows="ATT_Q01",
)
