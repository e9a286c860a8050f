"""Readings as frames: the half of a sensor that is the same for all of them.

What a sensor answers is looked at: a sensor that raises, that leaves a signal out, or measures in an epoch
that the block does not have or what no signal can carry, ends the run with one line of its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gnss_hil.dbc.common.arrays import U32
from gnss_hil.dbc.contract.batch_codec import Form, form
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.layout import Signal
from gnss_hil.dbc.contract.messages import HEADER_NAMES, KIND_BY_NAME, NODES
from gnss_hil.emulator.environment.block import Block
from gnss_hil.emulator.environment.epoch_frames import EpochFrames, epoch_frames
from gnss_hil.emulator.error_models.checked import ModelError
from gnss_hil.emulator.files.text import FileError
from gnss_hil.emulator.sensors.base import Reading, Row, Sensor, SensorContext
from gnss_hil.emulator.sensors.params import SensorParams
from gnss_hil.emulator.sensors.registry import SENSORS


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """A sensor on the bus: form of a record's messages, their identifiers (f,). said: what errors call it."""

    name: str
    said: str
    sensor: Sensor
    codec: Codec
    form: Form
    can_id: U32

    def over(self, block: Block) -> EpochFrames:
        """Its frames in a block; ModelError if it fails."""
        try:
            reading = self.sensor.over(block)
        except Exception as error:
            raise ModelError(f"{self.said}: {type(error).__name__}: {error}") from error
        if not isinstance(reading, Reading):
            raise ModelError(f"{self.said}: answers {type(reading).__name__}; asked for is Reading")
        return self.frames(reading, len(block.geometry))

    def frames(self, reading: Reading, epochs: int) -> EpochFrames:
        """A reading's frames in k epochs, one record after another; ModelError if there are none of it."""
        records = self._records(reading.epoch, epochs)
        self._check(reading.values, records)
        data, fits = self.form.fill(records, reading.values)
        if not fits.all():
            raise self._misfit(reading.values)
        words = np.ascontiguousarray(data).view("<u8").reshape(-1)
        epoch = np.repeat(reading.epoch, len(self.can_id))
        return epoch_frames(self.codec, epochs, epoch, np.tile(self.can_id, records), words, fits.reshape(-1))

    def _records(self, epoch: Any, epochs: int) -> int:
        """How many records there are in epochs (r,) of k."""
        if not (isinstance(epoch, np.ndarray) and epoch.ndim == 1 and epoch.dtype.kind in "iu"):
            raise ModelError(f"{self.said}: its epochs are no array (r,) of whole numbers")
        if len(epoch) and not (epoch[0] >= 0 and epoch[-1] < epochs and (epoch[1:] >= epoch[:-1]).all()):
            raise ModelError(f"{self.said}: its epochs do not ascend within the block's, 0 to {epochs - 1}")
        return len(epoch)

    def _check(self, values: Mapping[str, ArrayLike], records: int) -> None:
        """ModelError if there are not numbers (r,), or one number, of every signal and of nothing else."""
        for name in self.form.names:
            if name not in values:
                raise ModelError(f"{self._signal(name)} has no value")
        for name, given in values.items():
            if name not in self.form.names:
                raise ModelError(f"{self.said}: none of {', '.join(self.form.kinds)} has a signal {name}")
            array = np.asarray(given)
            if array.dtype.kind not in "biuf":
                raise ModelError(f"{self._signal(name)} is not of numbers")
            if array.shape not in ((), (records,)):
                raise ModelError(f"{self._signal(name)} has shape {array.shape}; there are {records} records")

    def _misfit(self, values: Mapping[str, ArrayLike]) -> ModelError:
        """Which value is none that its signal can carry; there is one."""
        for kind, signal in _signals(self.form.kinds):
            low, high = (raw * signal.factor + signal.offset for raw in signal.raw_range)
            array = np.asarray(values[signal.name], float).ravel()
            wrong = array[~(np.abs(array - (low + high) / 2) <= (high - low + signal.factor) / 2)]
            if len(wrong):
                carried = f"{low:g} to {high:g} {signal.unit}".rstrip()
                return ModelError(
                    f"{self.said}: {kind}.{signal.name} is {wrong[0]:g}; the bus carries {carried}"
                )
        raise AssertionError("a value that does not fit is out of its range")

    def _signal(self, name: str) -> str:
        kind = next(kind for kind, signal in _signals(self.form.kinds) if signal.name == name)
        return f"{self.said}: {kind}.{name}"


def _signals(kinds: tuple[str, ...]) -> list[tuple[str, Signal]]:
    """Kinds and their signals behind the header."""
    every = [(kind, signal) for kind in kinds for signal in KIND_BY_NAME[kind].signals]
    return [(kind, signal) for kind, signal in every if signal.name not in HEADER_NAMES]


def node(codec: Codec, row: Row, sensor: Sensor, owner: str) -> Node:
    """The node of a sensor in this contract; ModelError if the contract has no such node or messages.

    owner  whose it is, for people: "craft soyuz"
    """
    said = f"sensor '{row.name}' (node {row.node}, {owner})"
    if row.node not in NODES:
        raise ModelError(f"{said}: the contract has no node {row.node}; it has {', '.join(NODES)}")
    for kind in row.kinds:
        if kind not in KIND_BY_NAME:
            raise ModelError(f"{said}: the contract has no message {kind}")
        sender = KIND_BY_NAME[kind].sender
        if sender != row.node:
            raise ModelError(f"{said}: {kind} is a message of {sender}")
    can_id = np.array([codec.can_id_of[kind, 0] for kind in row.kinds], np.uint32)
    return Node(row.node, said, sensor, codec, form(codec, row.kinds), can_id)


def nodes(
    codec: Codec, on: Mapping[str, SensorParams], context: SensorContext, owner: str
) -> tuple[Node, ...]:
    """The nodes of a craft's sensors that are on; ValueError or FileError with one line if one cannot be had,
    ModelError if its row is none."""
    found: dict[str, Node] = {}
    for name, params in on.items():
        row = SENSORS[name]
        try:
            sensor = row.build(params, context)
        except (ValueError, FileError):
            raise
        except Exception as error:
            raise ModelError(f"sensor '{name}' ({owner}): {type(error).__name__}: {error}") from error
        one = node(codec, row, sensor, owner)
        if one.name in found:
            raise ModelError(f"{one.said}: the node is that of {found[one.name].said}")
        found[one.name] = one
    return tuple(found.values())
