"""Where a fault strikes: which frames of a batch stand at its place (`gnss_hil.emulator.faults.place`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from gnss_hil.dbc.common import satellites
from gnss_hil.dbc.common.arrays import I64, U64, Bool
from gnss_hil.dbc.common.limits import CHANNELS, MAX_RECEIVERS
from gnss_hil.dbc.common.near import nearest
from gnss_hil.dbc.common.systems import SYSTEMS
from gnss_hil.dbc.contract.allocation import BENCH_FIRST, BENCH_LAST
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import NODES, messages
from gnss_hil.emulator.faults.place import KIND_NAMES, SYSTEM_NAMES, Place, text


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
            found &= (self.fields.channel[can_id] >= 0) & self.channels[
                channel_of(self.fields, can_id, words)
            ]
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
            known = [*names, *NODES, *SYSTEM_NAMES, *KIND_NAMES]
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
