"""What a fault can strike at its place: one that could never do anything there is a mistake, told before the
start.

What the vehicle, the contract and the sky of a run tell is known here; what a run brings (whether a satellite
rises, whether a trigger comes about) is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.common.systems import SYSTEMS, tracked
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.emulator.faults.base import Actions, Direction
from gnss_hil.emulator.faults.kinds.row import RUN, Bus, Row, sent_by
from gnss_hil.emulator.faults.models import Fault
from gnss_hil.emulator.faults.place import text
from gnss_hil.emulator.faults.triggers import Tracks, Watch, meaning
from gnss_hil.emulator.faults.where import Where, receivers_of


@dataclass(frozen=True, slots=True, eq=False)
class Strays:
    """Identifiers (2048,) that are nobody's on the bus, but that faults before have frames of."""

    identifiers: Bool

    def and_of(self, row: Row, fault: Fault, place: Where) -> Strays:
        """With those of one more fault."""
        if row.makes is None:
            return self
        more = np.zeros(IDENTIFIERS, bool)
        more[row.makes(fault, place)] = True
        return Strays(self.identifiers | more)


def no_strays() -> Strays:
    return Strays(np.zeros(IDENTIFIERS, bool))


def reached(row: Row, fault: Fault, place: Where, bus: Bus, link: str | None, strays: Strays) -> Where:
    """A place without what the fault does nothing to there; ValueError with one line if nothing is left, or
    if it names a channel or satellite that there is not."""
    _check_channels(fault, bus)
    try:
        check_satellites(fault.on.satellite, fault.on.system, bus.sky)
    except ValueError as error:
        raise ValueError(f"on: {error}") from None
    if row.adds:
        return place
    left = place.identifiers & ((bus.codec.kind_of >= 0) | strays.identifiers)
    if not left.any():
        raise ValueError(f"on: no frame of this bus is at '{text(fault.on)}'")
    touched = row.touches(fault) if row.touches is not None else ()
    if touched:
        left = left & of_kinds(bus.codec, touched)
        if not left.any():
            raise ValueError(f"on: it acts on {', '.join(touched)}, and '{text(fault.on)}' has none of them")
    if link == RUN:
        left = _heard(row, fault, touched, left, bus.codec)
    return replace(place, identifiers=left)


def check_directions(row: Row, fault: Fault, place: Where, actions: Actions, codec: Codec) -> None:
    """ValueError if what a fault does is on frames of one direction, and those at its place go the other
    way."""
    from_flight = sent_by(codec, "FLIGHT")
    ways = {Direction.RECEIVERS: from_flight, Direction.FLIGHT: ~from_flight}
    if not row.adds and not any((place.identifiers & ways[way]).any() for way in actions):
        raise ValueError(f"on: it does nothing to what is at '{text(fault.on)}'")


def check_trigger(fault: Fault, bus: Bus) -> None:
    """ValueError if this bus and sky have nothing that a fault waits for."""
    if fault.at.after is None:
        return
    try:
        Watch(bus.codec, [fault.at.after], bus.names)
        awaited = meaning(fault.at.after)
        if isinstance(awaited, Tracks):
            check_satellites((awaited.satellite,), (), bus.sky)
    except ValueError as error:
        raise ValueError(f"at.after: {error}") from None


def of_kinds(codec: Codec, names: Sequence[str]) -> Bool:
    """(2048,) identifiers of kinds of messages."""
    return np.isin(codec.kind_of, [codec.kinds[name].number for name in names])


def _heard(row: Row, fault: Fault, touched: Sequence[str], identifiers: Bool, codec: Codec) -> Bool:
    """Without what nobody in the emulator hears: what the flight software sends is on record as it came, and
    receivers take commands of it alone."""
    unheard = sent_by(codec, "FLIGHT") & ~of_kinds(codec, ["COMMAND"])
    if (row.whole_nodes and "FLIGHT" in fault.on.node) or not (identifiers & ~unheard).any():
        what = ", ".join(touched) if fault.on.everything else text(fault.on)
        raise ValueError(
            f"{RUN} cannot do it to '{what}': what the flight software sends is on record before, "
            "and receivers take its commands alone (command-lost); gateway can"
        )
    return identifiers & ~unheard


def _check_channels(fault: Fault, bus: Bus) -> None:
    every = range(1, len(bus.names) + 1)
    receivers = receivers_of(fault.on, bus.names) or list(every)
    most = max((bus.channels[r - 1] for r in receivers), default=0)
    wrong = [f"ch{one}" for one in fault.on.channel if one >= most]
    if wrong:
        whose = ", ".join(f"rx{r}" for r in receivers) if fault.on.receiver else "the craft"
        raise ValueError(f"on: no channel {', '.join(wrong)}; {whose} has ch0 to ch{most - 1}")


def check_satellites(names: Sequence[str], systems: Sequence[str], sky: Bool | None) -> None:
    """ValueError for satellites and systems that a sky (SATELLITES,) does not have; None: it is not known."""
    if sky is None:
        return
    there = [one.name for one in tracked() if _of_system(one.name, sky).any()]
    has = f"the scenario has {', '.join(there) or 'none at all'}"
    for name in systems:
        if name not in there:
            raise ValueError(f"no satellites of {name}; {has}")
    for name in names:
        index = satellites.parse(name)
        system = next(one.name for one in SYSTEMS.values() if one.value == satellites.system_of(index))
        if system not in there:
            raise ValueError(f"no satellite {name}; {has}")
        if not sky[index]:
            known = [satellites.name(i) for i in np.flatnonzero(_of_system(system, sky)).tolist()]
            raise ValueError(f"no satellite {name} in the scenario; {did_you_mean(name, known)}")


def _of_system(name: str, sky: Bool) -> Bool:
    """A sky (SATELLITES,) without the satellites of other systems."""
    numbers = np.arange(satellites.SATELLITES)
    return sky & (satellites.system_of(numbers) == SYSTEMS[name].value)
