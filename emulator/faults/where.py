"""Where a fault strikes: which frames of a batch, by node, message, receiver, channel, satellite, identifier.

As text, in a one-liner or a file: words that all have to hold, each one thing or several with commas.

    rx2, aft          a receiver, by number or by its antenna's name: what it sends and what is sent to it
    TIME, ATT, FLIGHT  frames that a node sends
    RANGE, RX2_RATE, SV_*   messages by their names in the DBC, or kinds of them
    ch3               a channel, counted from 0
    G12, glonass      frames of what tracks a satellite, or any of a system
    0x100&0x7F0       identifiers by number and mask
    all               every frame
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64, U64, Bool
from gnss_hil.dbc.common.limits import CHANNELS, MAX_RECEIVERS
from gnss_hil.dbc.common.near import did_you_mean, nearest
from gnss_hil.dbc.common.systems import SYSTEMS, tracked
from gnss_hil.dbc.common.vehicle import Strict
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import BENCH_FIRST, BENCH_LAST, KINDS, NODES, messages

_RECEIVER = re.compile(r"rx([1-8])", re.IGNORECASE)
_CHANNEL = re.compile(r"ch(\d{1,2})", re.IGNORECASE)
_SATELLITE = re.compile(r"[A-Za-z]\d\d")
_IDENTIFIER = re.compile(r"(0x[0-9a-fA-F]{1,3})(?:&(0x[0-9a-fA-F]{1,3}))?")
_NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
_SYSTEMS = tuple(system.name for system in tracked())
_ANY_CHANNEL = -1


def _listed(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


_Words = Annotated[tuple[str, ...], BeforeValidator(_listed)]
_Whole = Annotated[
    tuple[Annotated[int, Field(ge=0, le=CHANNELS - 1)], ...],
    BeforeValidator(_listed),
]
_Identifiers = Annotated[tuple[Annotated[int, Field(ge=0, le=SFF_MASK)], ...], BeforeValidator(_listed)]
_Receivers = Annotated[
    tuple[Annotated[int, Field(ge=1, le=MAX_RECEIVERS)] | str, ...],
    BeforeValidator(_listed),
]

KIND_NAMES = tuple(kind.name for kind in KINDS if not kind.name.startswith("BENCH_"))


class Place(Strict):
    """Which frames: those for which every key holds that is given. Text, such as "rx2 RANGE ch3", is read
    as well.

    receiver     numbers from 1, or names of antennas: what they send and what is sent to them
    node         senders: TIME, ATT, FLIGHT, RX1 ...
    message      names in the DBC ("RX2_RANGE"), of a kind for all receivers ("RANGE"), with * for any part
    channel      numbers from 0
    satellite    names such as "G12": frames of a channel that tracks one, of its almanac, of commands
    system       "gps", "glonass": the same of all satellites of a system
    identifier   numbers of 11 bits, compared under the mask
    mask         bits of an identifier that count
    """

    receiver: _Receivers = ()
    node: _Words = ()
    message: _Words = ()
    channel: _Whole = ()
    satellite: _Words = ()
    system: _Words = ()
    identifier: _Identifiers = ()
    mask: Annotated[int, Field(ge=0, le=SFF_MASK)] = SFF_MASK

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        return parse(value.split()) if isinstance(value, str) else value

    @field_validator("satellite")
    @classmethod
    def _are_satellites(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        names = tuple(name.upper() for name in value)
        for name in names:
            satellites.parse(name)
        return names

    @field_validator("system")
    @classmethod
    def _are_systems(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(_known(name.lower(), _SYSTEMS, "system") for name in value)

    @field_validator("node")
    @classmethod
    def _are_nodes(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        every = [*(f"RX{r}" for r in range(1, MAX_RECEIVERS + 1)), *NODES]
        return tuple(_known(name.upper(), every, "node") for name in value)

    @field_validator("message")
    @classmethod
    def _are_messages(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        names = tuple(name.upper() for name in value)
        for name in names:
            if not _matches_any(name):
                raise ValueError(f"no message '{name}'; {did_you_mean(name, _message_names())}")
        return names

    @property
    def everything(self) -> bool:
        return self == Place()


def _known(name: str, known: Sequence[str], what: str) -> str:
    if name not in known:
        raise ValueError(f"no {what} '{name}'; {did_you_mean(name, known)}")
    return name


def _message_names() -> list[str]:
    every = (message.name for message in messages(MAX_RECEIVERS))
    return [*KIND_NAMES, *(name for name in every if not name.startswith("BENCH_"))]


def _matches_any(pattern: str) -> bool:
    return any(fnmatchcase(name, pattern) for name in _message_names())


def parse(words: Sequence[str]) -> dict[str, Any]:
    """Keys of a `Place` from words; ValueError names a word that is none."""
    found: dict[str, Any] = {}
    for word in words:
        for one in word.split(","):
            key, value = _meaning(one)
            if key == "identifier" and found.get("mask", value[1]) != value[1]:
                raise ValueError(f"'{one}': the identifiers of a place have one mask")
            if key == "identifier":
                found["mask"], value = value[1], value[0]
            if key:
                found.setdefault(key, []).append(value)
    return found


def _meaning(word: str) -> tuple[str, Any]:
    """Key and value of a word; key "" for `all`."""
    if word.lower() == "all":
        return "", None
    if match := _RECEIVER.fullmatch(word):
        return "receiver", int(match[1])
    if word.upper() in NODES:
        return "node", word.upper()
    if match := _CHANNEL.fullmatch(word):
        return "channel", int(match[1])
    if _SATELLITE.fullmatch(word):
        return "satellite", word.upper()
    if word.lower() in _SYSTEMS:
        return "system", word.lower()
    if match := _IDENTIFIER.fullmatch(word):
        return "identifier", (int(match[1], 16), int(match[2], 16) if match[2] else SFF_MASK)
    if _matches_any(word.upper()):
        return "message", word.upper()
    if _NAME.fullmatch(word):
        return "receiver", word  # an antenna's name: known when the vehicle is
    known = [*NODES, *_SYSTEMS, *_message_names()]
    raise ValueError(f"no place '{word}'; {_near(word, known)}")


def _near(word: str, known: Sequence[str]) -> str:
    near = nearest(word, known)
    if near:
        return f"did you mean '{near}'?"
    return "a receiver (rx2), node (ATT), message (RANGE), channel (ch3), satellite (G12), identifier (0x100)"


def text(place: Place) -> str:
    """A place in words that `parse` reads."""
    groups = (
        [f"rx{one}" if isinstance(one, int) else one for one in place.receiver],
        [*place.node],
        [*place.satellite],
        [*place.system],
        [*place.message],
        [f"ch{one}" for one in place.channel],
        [f"0x{one:03X}" + ("" if place.mask == SFF_MASK else f"&0x{place.mask:03X}") for one in place.identifier],
    )  # fmt: skip
    return " ".join(",".join(group) for group in groups if group) or "all"


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """Where frames carry channel and satellite, by identifier (2048,): shifts, -1 where there is none."""

    channel: I64
    system: I64
    number: I64


def fields_of(codec: Codec) -> Fields:
    """Shifts of a contract's `channel`, `sat_system` and `sat_number`."""
    shifts = {name: np.full(IDENTIFIERS, -1) for name in ("channel", "sat_system", "sat_number")}
    for can_id, number in enumerate(codec.kind_of.tolist()):
        layout = codec.layouts[number] if number >= 0 else None
        for name, table in shifts.items():
            if layout is not None and name in layout.signals:
                table[can_id] = int(layout.shift[layout.signals.index(name)])
    return Fields(*shifts.values())


@dataclass(frozen=True, slots=True, eq=False)
class Where:
    """A place on a bus with a contract.

    identifiers  (2048,) those that belong to it
    channels     (32,) those that count; None: frames without a channel too
    satellites   (SATELLITES,) those that count; None: frames without a satellite too
    """

    codec: Codec
    fields: Fields
    identifiers: Bool
    channels: Bool | None = None
    satellites: Bool | None = None

    def rows(self, frames: FrameBatch) -> Bool:
        """(n,) which frames of an epoch stand there; none that is not of 11 bits."""
        can_id = frames.can_id & SFF_MASK
        found = self.identifiers[can_id] & (frames.can_id <= SFF_MASK)
        if (self.channels is None and self.satellites is None) or not found.any():
            return found
        words = frames.words
        if self.channels is not None:
            found &= (self.fields.channel[can_id] >= 0) & self.channels[channel_of(self.fields, can_id, words)]
        if self.satellites is not None:
            sat = satellite_of(self.codec, self.fields, can_id, words)
            found &= (sat >= 0) & self.satellites[sat]
        return found


def channel_of(fields: Fields, can_id: Any, words: U64) -> I64:
    """(n,) channel that frames carry; meaningless where they carry none."""
    shift = np.maximum(fields.channel[can_id], 0).astype(np.uint64)
    return ((words >> shift) & np.uint64(CHANNELS - 1)).astype(np.int64)


def satellite_of(codec: Codec, fields: Fields, can_id: Any, words: U64) -> I64:
    """(n,) index of the satellite that frames of an epoch speak of, -1 none: what they name, or what their
    channel tracks by its SV_CLOCK of the same epoch."""
    names = fields.number[can_id] >= 0
    shift = np.maximum(fields.number[can_id], 0).astype(np.uint64)
    number = ((words >> shift) & np.uint64(satellites.NUMBERS - 1)).astype(np.int64)
    shift = np.maximum(fields.system[can_id], 0).astype(np.uint64)
    system = ((words >> shift) & np.uint64(7)).astype(np.int64)
    own = np.where(names, satellites.index(system, number), -1)
    tracked = np.full((MAX_RECEIVERS + 1, CHANNELS), -1)
    receiver, channel = codec.number_of[can_id], channel_of(fields, can_id, words)
    closing = codec.kind_of[can_id] == codec.kinds["SV_CLOCK"].number
    tracked[receiver[closing], channel[closing]] = own[closing]
    measured = ~names & (fields.channel[can_id] >= 0) & (codec.kind_of[can_id] >= 0)
    return np.where(measured, tracked[np.where(measured, receiver, 0), channel], own)


def receivers_of(place: Place, names: Sequence[str]) -> list[int]:
    """Numbers of the receivers that a place names; ValueError for one that the craft does not have."""
    found = []
    for one in place.receiver:
        if isinstance(one, int) and one > len(names):
            raise ValueError(f"no receiver rx{one}; the craft has rx1 to rx{len(names)}")
        if isinstance(one, str) and one not in names:
            known = [*names, *NODES, *_SYSTEMS, *KIND_NAMES]
            near = nearest(one, known)
            meant = f"did you mean '{near}'?" if near else f"the craft's antennas are {', '.join(names)}"
            raise ValueError(f"no place '{one}'; {meant}")
        found.append(one if isinstance(one, int) else names.index(one) + 1)
    return found


def resolve(place: Place, codec: Codec, names: Sequence[str], fields: Fields | None = None) -> Where:
    """A place on the bus of a craft with antennas of these names; ValueError if it is none there."""
    wanted = np.ones(IDENTIFIERS, bool)
    wanted[BENCH_FIRST : BENCH_LAST + 1] = False
    every = {message.can_id: message for message in messages(codec.receivers)}
    receivers = [f"RX{number}" for number in receivers_of(place, names)]
    for pick, of in (
        (receivers, lambda m, w: m.sender == w or m.name.startswith(f"{w}_")),
        (place.node, lambda m, w: m.sender == w),
        (place.message, lambda m, w: fnmatchcase(m.name, w) or fnmatchcase(m.kind.name, w)),
    ):
        if pick:
            hits = [can_id for can_id, m in every.items() if any(of(m, word) for word in pick)]
            wanted &= np.isin(np.arange(IDENTIFIERS), hits)
    if place.identifier:
        ids = np.arange(IDENTIFIERS)
        wanted &= np.logical_or.reduce([(ids ^ one) & place.mask == 0 for one in place.identifier])
    if not wanted.any():
        raise ValueError(f"no frame of this bus is at '{text(place)}'")
    channels = _only(CHANNELS, place.channel) if place.channel else None
    chosen = [satellites.parse(name) for name in place.satellite]
    for name in place.system:
        first = SYSTEMS[name].value * satellites.NUMBERS
        chosen += range(first, first + satellites.NUMBERS)
    sats = _only(satellites.SATELLITES, chosen) if chosen else None
    return Where(codec, fields or fields_of(codec), wanted, channels, sats)


def _only(count: int, chosen: Sequence[int]) -> Bool:
    found = np.zeros(count, bool)
    found[list(chosen)] = True
    return found
