"""A run with a sensor node of the test's own: a clinometer, as rows of the contract and of the registry.

`python -m tests.support.made_up_sensor RUN ...` is `gnss-hil run` where it exists. Rows come before anything
reads the tables, as if they stood in the files.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.contract import messages
from gnss_hil.emulator.sensors.params import SensorParams

NODE, NUMBER = "CLINO", 11
STEP_DEG = 0.01
KIND = messages._kind(
    "TILT", 0x070, NODE, ("FLIGHT",), "Angle between the local vertical and the boresight of one antenna.",
    messages._CHANNEL, messages._u("tilt_deg", 16, "from the zenith", "deg", STEP_DEG),
    messages._u("sample", 8, "within the epoch"), key="channel",
)  # fmt: skip


class Clinometer(SensorParams):
    """antenna  whose boresight;  every  how many epochs;  samples  in each of these."""

    antenna: int = 0
    every: int = 2
    samples: int = 3


@dataclass(frozen=True)
class Sensor:
    params: Clinometer

    def over(self, block):
        from gnss_hil.emulator.sensors.base import Reading

        at, params = block.geometry, self.params
        mine = np.flatnonzero(at.epoch % params.every == 0)
        up = at.state.pos_ecef_m / np.linalg.norm(at.state.pos_ecef_m, axis=1, keepdims=True)
        cosine = np.einsum("kj,kj->k", up, at.antennas.boresight[:, params.antenna])
        return Reading(
            np.repeat(mine, params.samples),
            {
                "channel": params.antenna,
                "tilt_deg": np.repeat(np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))[mine], params.samples),
                "sample": np.tile(np.arange(params.samples), len(mine)),
            },
        )


def add_rows() -> None:
    """Of the contract: message and node; of the sensors."""
    messages.KINDS = (*messages.KINDS, KIND)
    messages.KIND_BY_NAME[KIND.name] = KIND
    messages.NODES[NODE] = NUMBER
    from gnss_hil.emulator.sensors.base import Row
    from gnss_hil.emulator.sensors.registry import SENSORS

    SENSORS["clinometer"] = Row(
        "clinometer", Clinometer, NODE, (KIND.name,), "made up", lambda params, context: Sensor(params)
    )


if __name__ == "__main__":
    add_rows()
    from gnss_hil.tools.command_line.main import main

    sys.exit(main(["run", *sys.argv[1:]]))
