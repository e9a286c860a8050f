"""The place of a fault: node, message, receiver, channel, satellite, identifier.

Which frames stand there: `gnss_hil.emulator.faults.where`.

As text, in a one-liner or a file: words of different sorts, which all have to hold, each one thing or several
of its sort with commas, of which any does.

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
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Any

from pydantic import Field, field_validator

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.limits import CHANNELS, MAX_RECEIVERS
from gnss_hil.dbc.common.near import did_you_mean, nearest
from gnss_hil.dbc.common.systems import tracked
from gnss_hil.dbc.contract.frames import SFF_MASK
from gnss_hil.dbc.contract.messages import KINDS, NODES, messages
from gnss_hil.emulator.faults.spoken import OneOrMore, Spoken

_RECEIVER = re.compile(r"rx(\d+)", re.IGNORECASE)
_CHANNEL = re.compile(r"ch(\d+)", re.IGNORECASE)
_SATELLITE = re.compile(r"[A-Za-z]\d\d")
_IDENTIFIER = re.compile(r"(0x[0-9a-fA-F]{1,3})(?:&(0x[0-9a-fA-F]{1,3}))?")
_NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
SYSTEM_NAMES = tuple(system.name for system in tracked())


_Words = Annotated[tuple[str, ...], OneOrMore()]
_Whole = Annotated[
    tuple[Annotated[int, Field(ge=0, le=CHANNELS - 1)], ...],
    OneOrMore(),
]
_Identifiers = Annotated[tuple[Annotated[int, Field(ge=0, le=SFF_MASK)], ...], OneOrMore()]
_Receivers = Annotated[
    tuple[Annotated[int, Field(ge=1, le=MAX_RECEIVERS)] | str, ...],
    OneOrMore(),
]

KIND_NAMES = tuple(kind.name for kind in KINDS if not kind.name.startswith("BENCH_"))


class Place(Spoken):
    """Which frames: those for which every key holds that is given. Text, such as "rx2 RANGE ch3", is read
    as well.

    receiver     numbers from 1, or names of antennas: what they send and what is sent to them
    node         senders: TIME, ATT, FLIGHT, RX1 ...
    message      names in the DBC ("RX2_RANGE"), of a kind for all receivers ("RANGE"), with * for any part
    channel      numbers from 0
    satellite    names such as "G12": frames of a channel that tracks one, of its almanac, of commands
    system       "gps", "glonass": the same of all satellites of a system, beside those that are named
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

    @classmethod
    def _read(cls, text: str) -> dict[str, Any]:
        return parse(text.split())

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
        return tuple(_known(name.lower(), SYSTEM_NAMES, "system") for name in value)

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
    """Keys of a `Place` from words; ValueError names all that are none, a line each."""
    found: dict[str, Any] = {}
    spoken: dict[str, str] = {}
    wrong: list[str] = []
    for word in words:
        try:
            sort, more = _alternatives(word)
            _check_together(word, sort, spoken)
        except ValueError as error:
            wrong += str(error).splitlines()
            continue
        spoken[sort] = word
        found |= more
    if wrong:
        raise ValueError("\n".join(wrong))
    return found


_SORTS = {"": "everything", "system": "satellite"}
"""Sorts of words that are not called as their key."""


def _alternatives(word: str) -> tuple[str, dict[str, Any]]:
    """The sort of a word, and keys of a `Place` for what its commas part."""
    found: dict[str, Any] = {}
    sorts: list[str] = []
    wrong: list[str] = []
    prefix = ""
    for one in word.split(","):
        if prefix and one.isdigit():  # ch1,2
            one = prefix + one
        try:
            key, value = _meaning(one)
        except ValueError as error:
            wrong.append(str(error))
            continue
        prefix = {"channel": "ch", "receiver": "rx"}.get(key, "")
        sorts.append(_SORTS.get(key, key))
        if key == "identifier":
            if found.setdefault("mask", value[1]) != value[1]:
                wrong.append(f"'{one}': the identifiers of a place have one mask")
            value = value[0]
        if key:
            found.setdefault(key, []).append(value)
    if len(set(sorts)) > 1:
        kinds = " and ".join(dict.fromkeys(sorts))
        wrong.append(f"'{word}': commas are between words of one sort, found {kinds}; write a fault for each")
    if wrong:
        raise ValueError("\n".join(wrong))
    return sorts[0], found


def _check_together(word: str, sort: str, spoken: Mapping[str, str]) -> None:
    """ValueError for a second word of a sort: no frame is at both."""
    if sort in spoken:
        before = spoken[sort]
        raise ValueError(
            f"'{before} {word}': no frame is at both; for those at either, with a comma: {before},{word}"
        )
    if spoken and "everything" in (sort, *spoken):
        raise ValueError("'all' is every frame and stands alone")


def _meaning(word: str) -> tuple[str, Any]:
    """Key and value of a word; key "" for `all`."""
    if word.lower() == "all":
        return "", None
    if match := _RECEIVER.fullmatch(word):
        if not 1 <= int(match[1]) <= MAX_RECEIVERS:
            raise ValueError(f"no receiver '{word}'; there are rx1 to rx{MAX_RECEIVERS}")
        return "receiver", int(match[1])
    if word.upper() in NODES:
        return "node", word.upper()
    if match := _CHANNEL.fullmatch(word):
        if int(match[1]) >= CHANNELS:
            raise ValueError(f"no channel '{word}'; there are ch0 to ch{CHANNELS - 1}")
        return "channel", int(match[1])
    if _SATELLITE.fullmatch(word):
        return "satellite", word.upper()
    if word.lower() in SYSTEM_NAMES:
        return "system", word.lower()
    if match := _IDENTIFIER.fullmatch(word):
        return "identifier", (int(match[1], 16), int(match[2], 16) if match[2] else SFF_MASK)
    if _matches_any(word.upper()):
        return "message", word.upper()
    if _NAME.fullmatch(word):
        return "receiver", word  # an antenna's name: known when the vehicle is
    known = [*NODES, *SYSTEM_NAMES, *_message_names()]
    raise ValueError(f"no place '{word}'; {_near(word, known)}")


def _near(word: str, known: Sequence[str]) -> str:
    near = nearest(word, known)
    if near:
        return f"did you mean '{near}'?"
    return "a receiver (rx2), node (ATT), message (RANGE), channel (ch3), satellite (G12), identifier (0x100)"


def text(place: Place) -> str:
    """A place in words that `parse` reads."""
    mask = "" if place.mask == SFF_MASK else f"&0x{place.mask:03X}"
    groups = (
        [f"rx{one}" if isinstance(one, int) else one for one in place.receiver],
        [*place.node],
        [*place.satellite, *place.system],
        [*place.message],
        [f"ch{one}" for one in place.channel],
        [f"0x{one:03X}{mask}" for one in place.identifier],
    )  # fmt: skip
    return " ".join(",".join(group) for group in groups if group) or "all"
