"""Receivers that fail, as far as their frames show it: nothing here looks into the emulator.

A receiver that is off, starts anew or has no antenna goes on inside the emulator; behind the window it is
back at once, or after `reacquire_s`, in which it measures nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from gnss_hil.dbc.common.arrays import I64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.messages import MEASUREMENT_KINDS, messages
from gnss_hil.emulator.faults import traffic
from gnss_hil.emulator.faults.alter import Alter, Frozen, Noise, payload_bits
from gnss_hil.emulator.faults.base import Actions, Direction, Now, Rows, known, streams_of
from gnss_hil.emulator.faults.kinds.nodes import StartAnew
from gnss_hil.emulator.faults.kinds.row import Bus, Row
from gnss_hil.emulator.faults.models import Placed
from gnss_hil.emulator.faults.protect import Memory, Protection, no_memory, protect
from gnss_hil.emulator.faults.signals import with_signal, with_words
from gnss_hil.emulator.faults.where import Where

Seconds = Annotated[float, Field(ge=0, le=86_400)]


class _Receiver(Placed):
    """A fault of receivers."""

    @model_validator(mode="after")
    def _is_a_receiver(self):
        if not self.on.receiver:
            raise ValueError("on: which receiver? rx2, or the name of its antenna")
        return self


class ReceiverOff(_Receiver):
    """A receiver has no power: it sends nothing, its heartbeat neither, and obeys no command.

    reacquire_s   behind the window it is there and measures nothing for so long
    """

    kind: Literal["receiver-off"]
    reacquire_s: Seconds = 0.0


class ReceiverReset(_Receiver):
    """A receiver starts anew: silent while the window lasts, then with counters from 0 and a boot more.

    reacquire_s   behind the window it measures nothing for so long
    """

    kind: Literal["receiver-reset"]
    reacquire_s: Seconds = 5.0

    @model_validator(mode="after")
    def _ends(self):
        if self.at.stop is None and self.at.length is None and self.at.every is None:
            raise ValueError("at: needs an end, @30+5; it starts anew there")
        return self


class ReceiverStuck(_Receiver):
    """A receiver sends the measurements of the window's first epoch again and again, under live counters."""

    kind: Literal["receiver-stuck"]


class ReceiverGarbage(_Receiver):
    """A receiver measures anything: its measurement frames carry random bits under valid CRCs."""

    kind: Literal["receiver-garbage"]


class ReceiverSlow(_Receiver):
    """A receiver's frames come epochs late.

    epochs   by so many
    """

    kind: Literal["receiver-slow"]
    epochs: Annotated[int, Field(ge=1, le=1000)] = 1


class AntennaCut(_Receiver):
    """A receiver hears nothing: its channels measure nothing, its STATUS says so, it goes on talking.

    reacquire_s   behind the window it measures nothing for so long
    """

    kind: Literal["antenna-cut"]
    reacquire_s: Seconds = 5.0


def measuring(codec: Codec) -> Bool:
    """(2048,) identifiers of measurements."""
    found = np.zeros(IDENTIFIERS, bool)
    found[[m.can_id for m in messages(codec.receivers) if m.kind.name in MEASUREMENT_KINDS]] = True
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Deaf:
    """An action: no measurements, and a STATUS that says so, within the window and for some epochs behind it.

    behind   epochs behind the window;  within   in the window too

    A receiver counts what it sends: behind it the counters of measurements go on where they stood.

    state   memory of the STATUS, epochs to go, frames of each stream (streams,) that were not sent
    """

    codec: Codec
    behind: int
    within: bool

    def fresh(self) -> tuple[Memory, int, I64]:
        return no_memory(self.codec), 0, np.zeros(self.codec.streams, np.int64)

    def sleeps(self, state: tuple[Memory, int, I64], /) -> bool:
        return not state[1] and not state[2].any()

    def step(
        self, state: tuple[Memory, int, I64], frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[Any, FrameBatch, int]:
        memory, left, unsent = state
        measurements = rows.placed & measuring(self.codec)[frames.can_id & SFF_MASK]
        if now.active:
            left = self.behind
            if not self.within:
                return (memory, left, unsent), frames, 0
        elif left:
            left -= 1
        else:
            return state, *self._counted_on(frames, measurements, unsent)
        out, placed = frames[~measurements], rows.placed[~measurements]
        layout = self.codec.kinds["STATUS"]
        told = placed & (self.codec.kind_of[out.can_id & SFF_MASK] == layout.number)
        words = out.words.copy()
        for name, value in (("frames", 1), ("channels_tracking", 0)):  # the tag is one of its frames
            words[told] = with_signal(layout, name, words[told], np.full(int(told.sum()), value))
        altered = with_words(out, words)
        memory, altered = protect(Protection(), memory, out, altered, Rows(told, told), now)
        silent = frames[measurements & known(self.codec, frames)]
        unsent = unsent + np.bincount(streams_of(self.codec, silent), minlength=self.codec.streams)
        return (memory, left, unsent), altered, int(measurements.sum() + told.sum())

    def _counted_on(self, frames: FrameBatch, measurements: Bool, unsent: I64) -> tuple[FrameBatch, int]:
        """Frames with counters of measurements as if those unsent had never been, and how many that are."""
        at = np.flatnonzero(measurements & known(self.codec, frames))
        at = at[unsent[streams_of(self.codec, frames[at])] % e2e.COUNTERS != 0]
        if not len(at):
            return frames, 0
        data, fewer = frames.data.copy(), unsent[streams_of(self.codec, frames[at])]
        own = (data[at, 1] & 15).astype(np.int64)
        data[at, 1] = (data[at, 1] & 0xF0) | (own - fewer) % e2e.COUNTERS
        data[at, 0] = e2e.crc(frames.can_id[at], data[at])
        return replace(frames, data=data), len(at)


@dataclass(frozen=True, slots=True, eq=False)
class Both:
    """An action after another; each counts what it touches."""

    first: Any
    then: Any
    where: Where

    def fresh(self) -> tuple[Any, Any]:
        return self.first.fresh(), self.then.fresh()

    def sleeps(self, state: tuple[Any, Any], /) -> bool:
        return self.first.sleeps(state[0]) and self.then.sleeps(state[1])

    def step(
        self, state: tuple[Any, Any], frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[tuple[Any, Any], FrameBatch, int]:
        first, frames, touched = self.first.step(state[0], frames, rows, now)
        placed = self.where.rows(frames)
        then, frames, more = self.then.step(state[1], frames, Rows(placed, placed & now.active), now)
        return (first, then), frames, touched + more


def _behind(seconds: float, bus: Bus) -> int:
    return -(-round(seconds * NS_PER_S) // bus.interval_ns)


def _off(p: ReceiverOff, bus: Bus, where: Where) -> Actions:
    deaf = Deaf(bus.codec, _behind(p.reacquire_s, bus), within=False)
    return {Direction.FLIGHT: Both(traffic.Drop(), deaf, where), Direction.RECEIVERS: traffic.Drop()}


def _reset(p: ReceiverReset, bus: Bus, where: Where) -> Actions:
    deaf = Deaf(bus.codec, _behind(p.reacquire_s, bus), within=False)
    return {Direction.FLIGHT: Both(StartAnew(bus.codec), deaf, where), Direction.RECEIVERS: traffic.Drop()}


@dataclass(frozen=True, slots=True, eq=False)
class OfMeasurements:
    """An action on measurement frames alone."""

    inner: Any
    identifiers: Bool

    def fresh(self) -> Any:
        return self.inner.fresh()

    def sleeps(self, state: Any, /) -> bool:
        return self.inner.sleeps(state)

    def step(self, state: Any, frames: FrameBatch, rows: Rows, now: Now) -> tuple[Any, FrameBatch, int]:
        mine = self.identifiers[frames.can_id & SFF_MASK]
        return self.inner.step(state, frames, Rows(rows.placed & mine, rows.hit & mine), now)


def _content(content: Any, bus: Bus, only_changed: bool) -> Actions:
    alter = Alter(bus.codec, content, Protection(), only_changed)
    return {Direction.FLIGHT: OfMeasurements(alter, measuring(bus.codec))}


def _slow(p: ReceiverSlow, bus: Bus, where: Where) -> Actions:
    return {Direction.FLIGHT: traffic.Delay(p.epochs, drawn=False)}


def _measured(p: Placed) -> tuple[str, ...]:
    return tuple(sorted(MEASUREMENT_KINDS))


ROWS = (
    Row("receiver-off", ReceiverOff, "a receiver without power", _off, "rx2 receiver-off @2m+30s",
        words=("off",), of="receiver"),
    Row("receiver-reset", ReceiverReset, "a receiver starts anew", _reset, "rx2 receiver-reset @30+3",
        words=("reset",), of="receiver"),
    Row("receiver-stuck", ReceiverStuck, "a receiver repeats the measurements of one epoch, counters live",
        lambda p, bus, where: _content(Frozen(payload_bits(bus.codec)), bus, only_changed=False),
        "rx2 receiver-stuck @30+10", words=("freeze",), of="receiver", touches=_measured),
    Row("receiver-garbage", ReceiverGarbage, "a receiver measures anything",
        lambda p, bus, where: _content(Noise(payload_bits(bus.codec)), bus, only_changed=True),
        "rx2 receiver-garbage @30+10", of="receiver", touches=_measured),
    Row("receiver-slow", ReceiverSlow, "a receiver's frames come epochs late", _slow,
        "rx2 receiver-slow 1 @30+10", words=("slow",), of="receiver", first="epochs"),
    Row("antenna-cut", AntennaCut, "a receiver hears nothing and says so",
        lambda p, bus, where: {
            Direction.FLIGHT: Deaf(bus.codec, _behind(p.reacquire_s, bus), within=True)},
        "aft antenna-cut @30+10", words=("cut",), of="receiver",
        touches=lambda p: (*_measured(p), "STATUS")),
)  # fmt: skip
