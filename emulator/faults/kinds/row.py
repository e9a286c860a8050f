"""What a kind of faults is: a row of the registry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.emulator.faults.base import Action, Actions, Direction, Sleeper
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.emulator.faults.where import Where

RUN = "run"
"""`gnss-hil run`, inline, embedded and on SocketCAN: the emulator's process applies faults to what its nodes
send and hear; everybody on the bus hears the same."""

GATEWAY, CANGW = "gateway", "cangw"
"""Between two buses; as rules of the kernel's CAN gateway."""

LINKS = (RUN, GATEWAY, CANGW)


@dataclass(frozen=True, slots=True, eq=False)
class Bus:
    """One craft's bus, as far as a fault has to know it.

    names, clock_domain   of its antennas (m,)
    interval_ns           from one epoch to the next
    session               of the run
    channels              of each receiver (m,)
    sky                   (SATELLITES,) satellites that there are; None: not known
    """

    codec: Codec
    names: Sequence[str]
    clock_domain: Sequence[int]
    interval_ns: int
    session: int
    channels: Sequence[int]
    sky: Bool | None = None


Build = Callable[[Any, Bus, Where], Actions]
"""Makes actions of parameters (of the row's model), bus and place; ValueError with one line if it cannot."""


@dataclass(frozen=True, slots=True)
class Row:
    """A kind.

    summary   one line, for lists
    words     what a one-liner may call it besides;  of   only where the place has this key
    first     parameter that a value behind the name is for
    links     that can do it;  why   the others cannot, for people
    frames    whether it touches frames; else it acts elsewhere
    touches   kinds of messages that it does something to, by its parameters; None: to any
    adds      it puts frames in, and needs none at its place
    makes     identifiers, perhaps of nobody, that it puts on the bus, by its parameters and place
    whole_nodes   it is of all that a node sends
    detail    what a user has to know beyond the summary
    """

    name: str
    params: type[Fault]
    summary: str
    build: Build
    example: str
    words: tuple[str, ...] = ()
    of: str = ""
    first: str = ""
    links: tuple[str, ...] = (RUN, GATEWAY)
    why: str = "the kernel's gateway sees single frames and has no memory"
    frames: bool = True
    touches: Callable[[Any], Sequence[str]] | None = None
    adds: bool = False
    makes: Callable[[Any, Where], Any] | None = None
    whole_nodes: bool = False
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Idle(Sleeper):
    """An action that does nothing to frames: the fault acts elsewhere."""

    def fresh(self) -> None:
        return None

    def step(self, state: Any, frames: Any, rows: Any, now: Any) -> tuple[Any, Any, int]:
        return state, frames, 0


def sides(bus: Bus, where: Where, action: Action) -> Actions:
    """An action on the directions in which frames at a place go: from FLIGHT to the receivers, all others to
    the flight software. Of identifiers that are nobody's: to the flight software."""
    from_flight = sent_by(bus.codec, "FLIGHT")
    toward_flight = where.identifiers & ~from_flight
    found: dict[Direction, Action] = {}
    if toward_flight.any():
        found[Direction.FLIGHT] = action
    if (where.identifiers & from_flight).any():
        found[Direction.RECEIVERS] = action
    return found


def sent_by(codec: Codec, node: str) -> Bool:
    """(2048,) identifiers of what a node sends."""
    return np.array([sender == node for sender in codec.sender_of])
