"""The attitude unit: quaternion and rate at every time mark, what block 4 of RU 2706636 C1 puts out.

How far off it reports is the error models' (`attitude_error`).
"""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.common.arrays import F64
from gnss_hil.emulator.attitude.determination import reported_quaternion
from gnss_hil.emulator.environment.block import Block
from gnss_hil.emulator.sensors.base import Reading, Row, SensorContext
from gnss_hil.emulator.sensors.params import SensorParams


class AttitudeUnit(SensorParams):
    """Body axes from ECEF and their rate; no parameters."""


class Sensor:
    def over(self, block: Block) -> Reading:
        at = block.geometry
        quaternion, rate = at.quaternion, at.rate_body_rps
        if block.reported is not None:
            quaternion = reported_quaternion(quaternion, block.reported.angle_rad)
            rate = rate + block.reported.rate_rps
        return Reading(np.arange(len(at)), values(quaternion, rate))


def values(quaternion: F64, rate_body_rps: F64) -> dict[str, F64]:
    """Signals by name of quaternions (..., 4) of body from ECEF and rates (..., 3)."""
    q, w = np.moveaxis(quaternion, -1, 0), np.moveaxis(rate_body_rps, -1, 0)
    return {
        "q0": q[0], "q1": q[1], "q2": q[2], "q3": q[3],
        "wx_rps": w[0], "wy_rps": w[1], "wz_rps": w[2],
    }  # fmt: skip


def build(params: AttitudeUnit, context: SensorContext) -> Sensor:
    return Sensor()


ROW = Row(
    "attitude",
    AttitudeUnit,
    "ATT",
    ("ATT_Q01", "ATT_Q23", "ATT_RATE"),
    "the true attitude, with the error of `attitude_error`",
    build,
    default=True,
)
