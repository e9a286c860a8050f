"""The way of commands: to the receivers, and of their answers back.

On the links of a run a command that is lost is on record as the flight software sent it: what happens to it
happens at the receivers' door, and `faults.parquet` tells.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import U64, Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.emulator.faults import traffic
from gnss_hil.emulator.faults.alter import Alter
from gnss_hil.emulator.faults.base import Actions, Direction, Fits, Now
from gnss_hil.emulator.faults.kinds.row import LINKS, Bus, Row
from gnss_hil.emulator.faults.models import Altering, Fault
from gnss_hil.emulator.faults.place import Place
from gnss_hil.emulator.faults.protect import Protection
from gnss_hil.emulator.faults.signals import with_signal
from gnss_hil.emulator.faults.where import Where

COMMANDS = Place(message=("COMMAND",))


class CommandLost(Fault):
    """Commands do not reach the receivers."""

    kind: Literal["command-lost"]
    on: Place = COMMANDS


class CommandLate(Fault):
    """Commands reach the receivers epochs later.

    epochs   by so many; by three and more they are too old to be obeyed (docs/contract.md)
    """

    kind: Literal["command-late"]
    epochs: Annotated[int, Field(ge=1, le=1000)] = 1
    on: Place = COMMANDS


class CommandDoubled(Fault):
    """Commands reach the receivers twice.

    fresh   the second has a counter of its own and counts as a command; else it is the same frame again
    """

    kind: Literal["command-doubled"]
    fresh: bool = False
    on: Place = COMMANDS


class CommandAltered(Altering):
    """Commands reach the receivers with another satellite in them, under a valid CRC.

    satellite   that they name instead
    """

    kind: Literal["command-altered"]
    satellite: Annotated[str, BeforeValidator(lambda name: _satellite(name))] = "G01"
    on: Place = COMMANDS


class AckLost(Fault):
    """Answers to commands do not come: the receivers have obeyed, the flight software cannot know."""

    kind: Literal["ack-lost"]
    on: Place = Place(message=("ACK",))


def _satellite(name: Any) -> Any:
    if isinstance(name, str):
        satellites.parse(name)
    return name


class Renamed(Fits):
    """Content: another satellite in frames that name one."""

    def __init__(self, codec: Codec, sat: int):
        self._codec, self._sat = codec, sat

    def fresh(self, codec: Codec) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, hit: Bool, now: Now) -> tuple[None, U64]:
        words, layout = frames.words.copy(), self._codec.kinds["COMMAND"]
        rows = np.flatnonzero(hit & (self._codec.kind_of[frames.can_id & 0x7FF] == layout.number))
        for name, of in (("sat_system", satellites.system_of), ("sat_number", satellites.number_of)):
            words[rows] = with_signal(layout, name, words[rows], np.full(len(rows), int(of(self._sat))))
        return None, words


def _toward_receivers(action) -> Actions:
    return {Direction.RECEIVERS: action}


def _doubled(p: CommandDoubled, bus: Bus, where: Where) -> Actions:
    again = Protection(counter="recompute") if p.fresh else Protection(crc="keep")
    return _toward_receivers(traffic.Repeat(bus.codec, 1, at_end=False, again=again))


def _altered(p: CommandAltered, bus: Bus, where: Where) -> Actions:
    return _toward_receivers(
        Alter(bus.codec, Renamed(bus.codec, satellites.parse(p.satellite)), p.protection)
    )


def _commands(p: Fault) -> tuple[str, ...]:
    return ("COMMAND",)


ROWS = (
    Row("command-lost", CommandLost, "commands do not reach the receivers",
        lambda p, bus, where: _toward_receivers(traffic.Drop()), "command-lost @5+10", links=LINKS,
        touches=_commands),
    Row("command-late", CommandLate, "commands reach the receivers epochs later",
        lambda p, bus, where: _toward_receivers(traffic.Delay(p.epochs, drawn=False)),
        "command-late 2 @5+10", first="epochs", touches=_commands),
    Row("command-doubled", CommandDoubled, "commands reach the receivers twice", _doubled,
        "command-doubled @5+10", touches=_commands),
    Row("command-altered", CommandAltered, "commands name another satellite", _altered,
        "command-altered G01 @5+10", first="satellite", links=LINKS, touches=_commands),
    Row("ack-lost", AckLost, "answers to commands do not come",
        lambda p, bus, where: {Direction.FLIGHT: traffic.Drop()}, "ack-lost @5+10", links=LINKS,
        touches=lambda p: ("ACK",)),
)  # fmt: skip
