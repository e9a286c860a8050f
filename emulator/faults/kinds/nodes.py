"""Nodes that fall silent, start anew, or are there twice; and stray frames of the bench."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.dbc.contract.values import raw_of
from gnss_hil.dbc.lockstep import messages as bench
from gnss_hil.emulator.faults import traffic
from gnss_hil.emulator.faults.base import Action, Actions, Direction, Now, Rows, Sleeper, known, streams_of
from gnss_hil.emulator.faults.kinds.row import Bus, Row, sides
from gnss_hil.emulator.faults.models import Fault, Placed, Unplaced
from gnss_hil.emulator.faults.signals import physical, with_signal, with_words
from gnss_hil.emulator.faults.where import Where


class Silence(Placed):
    """A node sends nothing, its heartbeat neither; it goes on as if nothing had been."""

    kind: Literal["silence"]

    @model_validator(mode="after")
    def _is_a_node(self):
        if not (self.on.node or self.on.receiver):
            raise ValueError("on: a node (ATT, TIME) or a receiver (rx2) falls silent")
        return self


class Restart(Placed):
    """A node is silent while the window lasts and starts anew behind it: counters from 0, a boot more in its
    heartbeat. What it knows it does not lose: channels go on where they would be."""

    kind: Literal["restart"]

    @model_validator(mode="after")
    def _ends(self):
        if self.at.stop is None and self.at.length is None and self.at.every is None:
            raise ValueError("at: needs an end, @30+5; it starts anew there")
        if not (self.on.node or self.on.receiver):
            raise ValueError("on: a node (ATT) or a receiver (rx2) starts anew")
        return self


class SecondFlightComputer(Fault):
    """Another flight computer is on the bus: its heartbeat is heard, and it releases every channel that the
    first commands.

    boot_count   in its heartbeat
    commands     it sends commands too
    """

    kind: Literal["second-flight-computer"]
    boot_count: Annotated[int, Field(ge=0, le=255)] = 7
    commands: bool = True


class StrayBench(Unplaced):
    """Frames of the bench that are nobody's: another run's, of another epoch, or damaged.

    what      SYNC, DONE or END
    session   apart from the run's by so much
    epochs    ahead of the run by so many
    """

    kind: Literal["stray-bench"]
    what: Literal["SYNC", "DONE", "END"] = "SYNC"
    session: Annotated[int, Field(ge=0, le=65_535)] = 1
    epochs: Annotated[int, Field(ge=-30_000, le=30_000)] = 0


@dataclass(frozen=True, slots=True, eq=False)
class Starting:
    """Of each stream (streams,) by how much counters are ahead; how often the node has started anew; whether
    it is off; streams that have spoken since."""

    shift: I64
    boots: int = 0
    off: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class StartAnew:
    """An action: silent while the window lasts; counters from 0 and a boot more behind it."""

    codec: Codec

    def fresh(self) -> Starting:
        return Starting(np.zeros(self.codec.streams, np.int64))

    def sleeps(self, state: Starting, /) -> bool:
        return not (state.off or state.boots)

    def step(self, state: Starting, frames: FrameBatch, rows: Rows, now: Now) -> tuple[Any, FrameBatch, int]:
        if now.active:
            return replace(state, off=True), frames[~rows.hit], int(rows.hit.sum())
        if state.off:
            unset = np.full(self.codec.streams, -1)
            state = Starting(unset, state.boots + 1, off=False)
        if not state.boots:
            return state, frames, 0
        at = np.flatnonzero(rows.placed & known(self.codec, frames))
        if not len(at):
            return state, frames, 0
        words, stream = frames.words.copy(), streams_of(self.codec, frames[at])
        layout = self.codec.kinds["HEARTBEAT"]
        beats = at[self.codec.kind_of[frames.can_id[at]] == layout.number]
        boots = physical(layout, "boot_count", words[beats]) + state.boots
        words[beats] = with_signal(layout, "boot_count", words[beats], boots % 256)
        frames = with_words(frames, words)
        own = (frames.data[at, 1] & 15).astype(np.int64)
        shift = state.shift.copy()
        new = np.flatnonzero(shift[stream] < 0)[::-1]  # the first of a stream is set last
        shift[stream[new]] = -own[new] % e2e.COUNTERS
        data = frames.data
        data[at, 1] = (data[at, 1] & 0xF0) | (own + shift[stream]) % e2e.COUNTERS
        data[at, 0] = e2e.crc(frames.can_id[at], data[at])
        return replace(state, shift=shift), frames, len(at)


@dataclass(frozen=True, slots=True, eq=False)
class AnotherHeartbeat(Sleeper):
    """An action: the heartbeat of a node that is there twice."""

    codec: Codec
    frame: FrameBatch

    def fresh(self) -> int:
        return 0

    def step(self, sent: int, frames: FrameBatch, rows: Rows, now: Now) -> tuple[int, FrameBatch, int]:
        if not now.active:
            return sent, frames, 0
        return sent + 1, concat((frames, traffic.sealed(self.frame, 1, sent, now))), 1


@dataclass(frozen=True, slots=True, eq=False)
class Countermand(Sleeper):
    """An action: behind the commands a release of each of their channels, from a sender with its own
    counter."""

    codec: Codec

    def fresh(self) -> int:
        return 0

    def step(self, sent: int, frames: FrameBatch, rows: Rows, now: Now) -> tuple[int, FrameBatch, int]:
        layout = self.codec.kinds["COMMAND"]
        commands = frames[rows.hit & (self.codec.kind_of[frames.can_id & 0x7FF] == layout.number)]
        if not len(commands):
            return sent, frames, 0
        words = with_signal(
            layout, "action", commands.words, np.full(len(commands), raw_of("Action")["RELEASE"])
        )
        added = traffic.sealed(with_words(commands, words), 1, sent, now)
        return sent + 1, concat((frames, added)), len(added)


@dataclass(frozen=True, slots=True)
class Stray(Sleeper):
    """An action: a bench frame in every epoch."""

    can_id: int
    session: int
    epochs: int

    def fresh(self) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, rows: Rows, now: Now) -> tuple[None, FrameBatch, int]:
        if not now.active:
            return None, frames, 0
        epoch = max(now.at.epoch + self.epochs, 0)
        added = bench.encode(self.can_id, self.session, epoch, 0)
        half = len(frames) // 2
        return None, concat((frames[:half], added, frames[half:])), 1


def _sent(p: Silence | Restart, bus: Bus, where: Where, action: Action) -> Actions:
    """An action on what the nodes at a place send: of receivers not on what is sent to them."""
    found = dict(sides(bus, where, action))
    if "FLIGHT" not in p.on.node:
        found.pop(Direction.RECEIVERS, None)
    return found


def _second(p: SecondFlightComputer, bus: Bus, where: Where) -> Actions:
    codec = bus.codec
    values = {
        "state": raw_of("NodeState")["RUNNING"],
        "boot_count": p.boot_count,
        "contract_hash": codec.hash,
    }
    beat = batch(codec.can_id_of["HEARTBEAT", FLIGHT_NODE], codec.encode("HEARTBEAT", values, 1))
    actions: dict = {Direction.FLIGHT: AnotherHeartbeat(codec, beat)}
    if p.commands:
        actions[Direction.RECEIVERS] = Countermand(codec)
    return actions


_BENCH = {"SYNC": bench.SYNC_ID, "DONE": bench.DONE_ID, "END": bench.END_ID}


def _stray(p: StrayBench, bus: Bus, where: Where) -> Actions:
    return {Direction.FLIGHT: Stray(_BENCH[p.what], (bus.session + p.session) % (1 << 16), p.epochs)}


ROWS = (
    Row("silence", Silence, "a node sends nothing",
        lambda p, bus, where: _sent(p, bus, where, traffic.Drop()),
        "ATT silence @30+10", words=("off", "silent"), whole_nodes=True),
    Row("restart", Restart, "a node is silent, then starts anew: counters from 0, a boot more",
        lambda p, bus, where: _sent(p, bus, where, StartAnew(bus.codec)),
        "ATT restart @30+10", whole_nodes=True),
    Row("second-flight-computer", SecondFlightComputer, "another flight computer commands too", _second,
        "second-flight-computer @30+10", adds=True),
    Row("stray-bench", StrayBench, "frames of lockstep that are nobody's", _stray,
        "stray-bench SYNC @30+5", first="what", adds=True),
)  # fmt: skip
