"""Readings as frames: the half of a sensor that is the same for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import U32
from gnss_hil.dbc.contract.batch_codec import Form, form
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.emulator.environment.block import Block
from gnss_hil.emulator.environment.epoch_frames import EpochFrames, epoch_frames
from gnss_hil.emulator.sensors.base import Reading, Row, Sensor, SensorContext
from gnss_hil.emulator.sensors.params import SensorParams
from gnss_hil.emulator.sensors.registry import SENSORS


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """A sensor on the bus: form of a record's messages, their identifiers (f,)."""

    name: str
    sensor: Sensor
    codec: Codec
    form: Form
    can_id: U32

    def over(self, block: Block) -> EpochFrames:
        """Its frames in a block."""
        return self.frames(self.sensor.over(block), len(block.geometry))

    def frames(self, reading: Reading, epochs: int) -> EpochFrames:
        """A reading's frames in k epochs, one record after another."""
        records = len(reading.epoch)
        data, fits = self.form.fill(records, reading.values)
        words = np.ascontiguousarray(data).view("<u8").reshape(-1)
        epoch = np.repeat(reading.epoch, len(self.can_id))
        return epoch_frames(self.codec, epochs, epoch, np.tile(self.can_id, records), words, fits.reshape(-1))


def node(codec: Codec, row: Row, sensor: Sensor) -> Node:
    """The node of a sensor in this contract."""
    can_id = np.array([codec.can_id_of[kind, 0] for kind in row.kinds], np.uint32)
    return Node(row.node, sensor, codec, form(codec, row.kinds), can_id)


def nodes(codec: Codec, on: Mapping[str, SensorParams], context: SensorContext) -> tuple[Node, ...]:
    """The nodes of sensors that are on; ValueError or FileError with one line if one cannot be had."""
    return tuple(
        node(codec, SENSORS[name], SENSORS[name].build(params, context)) for name, params in on.items()
    )
