"""Frames that are lost, repeated, late, out of order or nobody's."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.dbc.contract.messages import messages
from gnss_hil.emulator.faults import traffic
from gnss_hil.emulator.faults.alter import Alter, Same
from gnss_hil.emulator.faults.base import Actions, Direction
from gnss_hil.emulator.faults.kinds.row import CANGW, GATEWAY, LINKS, Bus, Row, sides
from gnss_hil.emulator.faults.models import Placed, Unplaced
from gnss_hil.emulator.faults.protect import Protection
from gnss_hil.emulator.faults.signals import Number
from gnss_hil.emulator.faults.where import Where

KEEP = Protection(crc="keep")
Epochs = Annotated[int, Field(ge=1, le=100_000)]


class Loss(Placed):
    """Frames do not come: single ones (n=1), a burst (a window), a share (p=0.1)."""

    kind: Literal["loss"]


class Repetition(Placed):
    """Frames come again.

    copies    how often
    spacing   "at once": behind the frame; "block": behind the epoch's last
    protection   of the repetitions: keep: the same frames; {counter = "recompute"}: as if they were new
    """

    kind: Literal["repetition"]
    copies: Annotated[int, Field(ge=1, le=1000)] = 1
    spacing: Literal["at once", "block"] = "at once"
    protection: Protection = KEEP


class Delay(Placed):
    """Frames come later, as they were, behind those of the epoch then.

    epochs   by so many
    """

    kind: Literal["delay"]
    epochs: Epochs = 1


class Jitter(Placed):
    """Frames come later, each by a number of epochs of its own, drawn from 0 on.

    most_epochs   at most
    """

    kind: Literal["jitter"]
    most_epochs: Epochs = 2


class Reordering(Placed):
    """Frames of an epoch change places among themselves.

    order   "drawn": any; "backwards": from last to first
    """

    kind: Literal["reordering"]
    order: Literal["drawn", "backwards"] = "drawn"


class Insertion(Unplaced):
    """Frames that nobody of the craft sent.

    message      in the DBC, whose signals are given; or
    identifier   any of 11 bits, and
    data         its payload in hexadecimal digits, protected as they say
    signals      in their units, by name; the others are 0. It is protected by a counter of its own
    frames       so many an epoch
    first        before the others of the epoch; else behind them
    """

    kind: Literal["insertion"]
    message: str | None = None
    identifier: Annotated[int, Field(ge=0, le=0x7FF)] | None = None
    data: Annotated[str, Field(pattern=r"^([0-9A-Fa-f]{2}){0,8}$")] = "0000000000000000"
    signals: dict[str, Number] = Field(default_factory=dict)
    frames: Annotated[int, Field(ge=1, le=10_000)] = 1
    first: bool = False

    @model_validator(mode="after")
    def _is_a_frame(self):
        if (self.message is None) == (self.identifier is None):
            raise ValueError("one of message and identifier")
        return self


class WrongAddress(Placed):
    """Frames come under another identifier.

    identifier   the other one
    mask         of its bits that are set; 0x7FF: all
    protection   keep: the CRC is over the true data id, as the sender made it; recompute: over the new one
    """

    kind: Literal["wrong-address"]
    identifier: Annotated[int, Field(ge=0, le=0x7FF)]
    mask: Annotated[int, Field(ge=1, le=0x7FF)] = 0x7FF
    protection: Protection = KEEP


class WrongSequence(Placed):
    """Frames carry a counter that is not theirs, under a valid CRC.

    step    ahead of theirs
    after   the counter behind the fault: correct, last-valid, last-value
    """

    kind: Literal["wrong-sequence"]
    step: Annotated[int, Field(ge=1, le=14)] = 7
    after: Literal["correct", "last-valid", "last-value"] = "correct"


class Replay(Placed):
    """What was sent epochs before comes in the place of what is sent: valid frames of an old window.

    lag          epochs
    protection   keep: the old frames, bit for bit; {counter = "recompute", epoch = "recompute"}: with the
                 counter and epoch of today
    """

    kind: Literal["replay"]
    lag: Epochs
    protection: Protection = KEEP


class Babbling(Unplaced):
    """A node sends without end: a load on the bus, of frames that mean nothing. Its arbitration is not
    modelled: frames of others are not held up.

    frames       an epoch
    identifier   of them, low: it would win every arbitration
    """

    kind: Literal["babbling"]
    frames: Annotated[int, Field(ge=1, le=100_000)] = 500
    identifier: Annotated[int, Field(ge=0, le=0x7FF)] = 0x001


class Asymmetric(Placed):
    """Frames reach one consumer and not the other: the bus they come from has them, the bus they go to has
    not."""

    kind: Literal["asymmetric"]


def _insertion(p: Insertion, bus: Bus, where: Where) -> Actions:
    codec = bus.codec
    if p.identifier is not None:
        frame = batch(p.identifier, bytes.fromhex(p.data))
        return {Direction.FLIGHT: traffic.Insert(codec, frame, p.frames, p.first, sealed=False)}
    known = {m.name: m for m in messages(codec.receivers)}
    message = known.get((p.message or "").upper())
    if message is None:
        raise ValueError(f"message: no '{p.message}'; {did_you_mean(p.message or '', known)}")
    layout = codec.kinds[message.kind.name]
    for name in p.signals:
        if name not in layout.signals:
            meant = did_you_mean(name, layout.signals)
            raise ValueError(f"signals: {message.name} has no signal '{name}'; {meant}")
    values = {name: np.array([value]) for name, value in p.signals.items()} or {layout.signals[-1]: 0}
    frame = batch(message.can_id, codec.encode(message.kind.name, values, 1))
    direction = Direction.RECEIVERS if message.sender == "FLIGHT" else Direction.FLIGHT
    return {direction: traffic.Insert(codec, frame, p.frames, p.first, sealed=True)}


def _readdressed(p: WrongAddress, identifiers: Any) -> Any:
    """Identifiers under which frames of others come."""
    return identifiers & ~p.mask | p.identifier & p.mask


def _wrong_address(p: WrongAddress, bus: Bus, where: Where) -> Actions:
    own = np.flatnonzero(where.identifiers)
    if np.array_equal(_readdressed(p, own), own):
        raise ValueError(f"identifier: 0x{p.identifier:03X} is the frames' own")
    return sides(bus, where, traffic.Readdress(bus.codec, p.identifier & p.mask, p.mask, p.protection))


def _sequence(p: WrongSequence, bus: Bus, where: Where) -> Actions:
    how = Protection(counter="offset", counter_by=p.step, after=p.after)
    return sides(bus, where, Alter(bus.codec, Same(), how, only_changed=False))


def _babbling(p: Babbling, bus: Bus, where: Where) -> Actions:
    frame = batch(p.identifier, bytes(8))
    return {Direction.FLIGHT: traffic.Insert(bus.codec, frame, p.frames, first=True, sealed=False)}


ROWS = (
    Row("loss", Loss, "frames do not come: single, a burst, a share of them",
        lambda p, bus, where: sides(bus, where, traffic.Drop()),
        "0x100&0x7F0 loss @1m p=0.1", words=("drop", "lose", "lost"), links=LINKS),
    Row("repetition", Repetition, "frames come again, at once or at the end of the epoch's block",
        lambda p, bus, where: sides(
            bus, where, traffic.Repeat(bus.codec, p.copies, p.spacing == "block", p.protection)),
        "rx1 RANGE repetition 2 @30+10", words=("repeat",), first="copies"),
    Row("delay", Delay, "frames come epochs later",
        lambda p, bus, where: sides(bus, where, traffic.Delay(p.epochs, drawn=False)),
        "rx3 delay 1 @30+10", words=("late",), first="epochs"),
    Row("jitter", Jitter, "frames come later, each by a number of epochs of its own",
        lambda p, bus, where: sides(bus, where, traffic.Delay(p.most_epochs, drawn=True)),
        "ATT jitter 2 @30+20", first="most_epochs"),
    Row("reordering", Reordering, "frames of an epoch change places",
        lambda p, bus, where: sides(bus, where, traffic.Shuffle(p.order == "backwards")),
        "rx1 reordering @30+10", words=("reorder", "shuffle"), first="order"),
    Row("insertion", Insertion, "frames that nobody of the craft sent", _insertion,
        "insertion identifier=0x3A5 data=DEADBEEF frames=20 @30+10", words=("insert",), adds=True,
        makes=lambda p, where: [] if p.identifier is None else [p.identifier]),
    Row("wrong-address", WrongAddress, "frames come under another identifier",
        _wrong_address,
        "rx1 RANGE wrong-address 0x110 @30+10", words=("readdress",), first="identifier", links=LINKS,
        makes=lambda p, where: _readdressed(p, np.flatnonzero(where.identifiers))),
    Row("wrong-sequence", WrongSequence, "counters that are not the frames' own, under a valid CRC",
        _sequence, "rx2 wrong-sequence 7 @30+10", first="step"),
    Row("replay", Replay, "valid frames of an old window in the place of today's",
        lambda p, bus, where: sides(bus, where, traffic.Replay(bus.codec, p.lag, p.protection)),
        "rx2 replay 16 @40+10", first="lag"),
    Row("babbling", Babbling, "a node that sends without end, as load", _babbling,
        "babbling 2000 @30+10", words=("babble",), first="frames", adds=True,
        makes=lambda p, where: [p.identifier]),
    Row("asymmetric", Asymmetric, "frames reach one consumer and not the other",
        lambda p, bus, where: sides(bus, where, traffic.Drop()),
        "rx2 asymmetric @30+10", links=(GATEWAY, CANGW),
        why="everybody on one bus hears the same"),
)  # fmt: skip
