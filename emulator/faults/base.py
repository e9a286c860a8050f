"""What faults are made of: the epoch at hand, and actions on its frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

import numpy as np

from gnss_hil.dbc.common.arrays import F64, I64, U64, Bool
from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.emulator.numerics.keyed_draws import Stream, uniform


class Direction(Enum):
    """Where frames go: to the flight software, or from it to the receivers."""

    FLIGHT = "flight"
    RECEIVERS = "receivers"


@dataclass(frozen=True, slots=True)
class At:
    """Whose frames are at hand.

    epoch      whose mark was the last
    t_ns       its simulated time, undisturbed
    direction  of the frames
    """

    epoch: int
    t_ns: int
    direction: Direction


@dataclass(frozen=True, slots=True)
class Now:
    """The epoch at hand, for one fault.

    active   whether it acts;  since  first epoch of the window, or of the part of it; -1 outside
    draws    of the fault
    """

    codec: Codec
    at: At
    active: bool
    since: int
    interval_ns: int
    draws: Stream

    @property
    def elapsed_s(self) -> float:
        """Since the window began."""
        return (self.at.epoch - self.since) * self.interval_ns / NS_PER_S

    def words(self, purpose: str, count: int) -> U64:
        """(count,) random words of this epoch and direction for a purpose."""
        stream = Stream(self.draws.seed, self.draws.owner, f"{self.draws.name}, {purpose}")
        return stream.words(2 * self.at.epoch + (self.at.direction is Direction.RECEIVERS), count)

    def uniform(self, purpose: str, count: int) -> F64:
        """(count,) numbers in (0, 1), likewise."""
        return uniform(self.words(purpose, count))


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Of the frames of an epoch (n,): those at the fault's place, and those of them that it strikes now."""

    placed: Bool
    hit: Bool


class Action(Protocol):
    """What a fault does to frames of one direction; called in every epoch but where it sleeps.

    `step` returns the state after the epoch, the frames, and how many it has touched: taken out, put in or
    changed. A pure function.
    """

    def fresh(self) -> Any:
        """State before the first epoch."""
        ...

    def sleeps(self, state: Any, /) -> bool:
        """Whether outside the window nothing happens: then it is not called."""
        ...

    def step(
        self, state: Any, frames: FrameBatch, rows: Rows, now: Now, /
    ) -> tuple[Any, FrameBatch, int]: ...


class Sleeper:
    """What acts within its window alone."""

    __slots__ = ()

    def sleeps(self, state: Any, /) -> bool:
        return True


class Fits:
    """Content whose values are all such as their signals can carry."""

    __slots__ = ()

    def clipped(self, state: Any, /) -> int:
        return 0


Actions = Mapping[Direction, Action]


def streams_of(codec: Codec, frames: FrameBatch) -> I64:
    """(n,) protected stream of frames of the contract."""
    return codec.key_of(frames.can_id & SFF_MASK, frames.data)


def ranks(stream: I64) -> I64:
    """(n,) how many of the same stream come before each."""
    order = np.argsort(stream, kind="stable")
    ordered = stream[order]
    first = np.ones(len(stream), bool)
    first[1:] = ordered[1:] != ordered[:-1]
    place = np.arange(len(stream))
    found = np.empty(len(stream), np.int64)
    found[order] = place - np.maximum.accumulate(np.where(first, place, 0))
    return found


def known(codec: Codec, frames: FrameBatch) -> Bool:
    """(n,) which frames are of the contract: protected, of eight bytes."""
    return (frames.can_id <= SFF_MASK) & (codec.kind_of[frames.can_id & SFF_MASK] >= 0) & (frames.length == 8)
