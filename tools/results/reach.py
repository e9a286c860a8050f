"""Where a fault can be seen: which places of checks are its own.

Checks of single frames are of a message, those of nodes of a node, those of content of a satellite or a
receiver. A fault on one receiver is not seen by what another one lacks. Marks open every node's epoch, so a
fault on them may be seen anywhere; so may one without a place.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import SFF_MASK
from gnss_hil.dbc.contract.messages import messages
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.emulator.faults.where import Where, resolve
from gnss_hil.tools.results.checks import FLIGHT, TIME
from gnss_hil.tools.results.detectors import Sign

_OF_FRAMES = ("lost", "repeated", "wrong-sequence", "corrupted", "mixed-epoch", "wrong-length")
"""Words of checks of single frames: of a message, and not of whatever else its node sends."""
_SATELLITE = re.compile(r"[A-Z]\d\d")


@dataclass(frozen=True, slots=True)
class Reach:
    """What a fault touches: messages by name, and identifiers that are nobody's; nodes that send or are sent
    them, satellites, None: of any.

    everywhere   whether it may be seen at any place
    """

    everywhere: bool
    messages: frozenset[str] = frozenset()
    nodes: frozenset[str] = frozenset()
    satellites: frozenset[str] | None = None

    def has(self, sign: Sign) -> bool:
        """Whether what a check saw is at a place of the fault's. What has no place may be of any fault."""
        where = sign.where
        if self.everywhere or where == FLIGHT:
            return True
        if _SATELLITE.fullmatch(where):
            return self.satellites is None or where in self.satellites
        if sign.word in _OF_FRAMES and "_" in where:
            return where in self.messages
        return bool(self.nodes & {where, where.partition("_")[0]}) or where in self.messages

    def has_frames(self, where: str) -> bool:
        """Whether frames of a message or identifier may be the fault's."""
        return self.everywhere or where in self.messages


def reach(fault: Fault, antennas: Sequence[str]) -> Reach:
    """Of a fault on the bus of a craft with antennas of these names."""
    where = resolve(fault.on, codec(len(antennas)), antennas)
    carried = _carried(where) | _renamed(fault)
    touched = [one for one in messages(len(antennas)) if carried[one.can_id]]
    nodes = {one.sender for one in touched} | {
        one.name.partition("_")[0] for one in touched if one.name.startswith("RX")
    }
    of_contract = {one.can_id for one in messages(len(antennas))}
    nobodys = {f"0x{one:03X}" for one in np.flatnonzero(carried).tolist() if one not in of_contract}
    of = None if where.satellites is None else np.flatnonzero(where.satellites).tolist()
    return Reach(
        fault.on.everything or TIME in nodes,
        frozenset(one.name for one in touched) | nobodys,
        frozenset(nodes),
        None if of is None else frozenset(map(satellites.name, of)),
    )


def _carried(where: Where) -> np.ndarray:
    """(2048,) identifiers of a place whose frames can be at it: with a channel, where it names some; with a
    satellite, or a channel that tracks it."""
    found = where.identifiers.copy()
    channel, number = where.fields.channel >= 0, where.fields.number >= 0
    if where.channels is not None:
        found &= channel
    if where.satellites is not None:
        found &= channel | number
    return found


def _renamed(fault: Fault) -> np.ndarray:
    """(2048,) identifiers under which a fault makes frames come."""
    identifier, mask = getattr(fault, "identifier", None), getattr(fault, "mask", SFF_MASK)
    every = np.arange(SFF_MASK + 1)
    return every * 0 > 0 if identifier is None else (every ^ identifier) & mask == 0
