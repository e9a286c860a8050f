"""What every sensor node is made of, and how a new one comes in.

A sensor is one row in one file of this room: its parameters, its node and messages in the contract, a
function that builds it. It measures in blocks of epochs, in the environment, which no command changes; an
epoch's frames are then its slice of the block, the same for all sensors (`gnss_hil.emulator.sensors.frames`).

To add one:

    dbc/contract/messages.py        its messages and its node (then `make docs`)
    emulator/sensors/NAME.py        parameters, sensor, `ROW`
    emulator/sensors/registry.py    its name
    tests/emulator/sensors/         its test

Which identifiers and node numbers are free stands at the head of the contract's table. A reading is looked at
as answers of error models are: what is missing, or what a signal cannot carry, ends the run with one line.
Scenario keys (`[craft.sensors]`), frames, their protection and the node's heartbeat follow. Recorder and
decoder read what the contract has; the flight software reads what its `io/frame_groups.py` names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import ArrayLike

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.environment.block import Block
from gnss_hil.emulator.error_models.base import CraftContext
from gnss_hil.emulator.orbits.motion import Motion
from gnss_hil.emulator.sensors.params import SensorParams


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """What a sensor has measured in a block: r records, each of which fills every message of its row once.

    epoch    (r,) epoch of the block, 0-based, in which each is sent, ascending; several may be of one epoch,
             of others there may be none
    values   signals by name, (r,) each or one number for all
    """

    epoch: I64
    values: Mapping[str, ArrayLike]


class Sensor(Protocol):
    """A sensor at work."""

    def over(self, block: Block) -> Reading:
        """What it measures in a block. A pure function: a run may begin with any block."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class SensorContext(CraftContext):
    """What sensors are built from: as models of the craft are, and motion_of, the motion of a craft of the
    scenario by its name, ValueError if there is none to know."""

    motion_of: Callable[[str], Motion]


@dataclass(frozen=True, slots=True)
class Row:
    """A sensor.

    params   its parameters, which validate themselves
    node     of the contract that sends its frames
    kinds    messages of the contract, in the order in which a record fills them
    source   of its formulas
    build    parameters and context -> the sensor; ValueError or FileError with one line if it cannot be had
    default  there where a scenario does not name it
    """

    name: str
    params: type[SensorParams]
    node: str
    kinds: tuple[str, ...]
    source: str
    build: Callable[[Any, SensorContext], Sensor]
    default: bool = False
