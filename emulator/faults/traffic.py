"""Frames that a fault takes out, sends again, holds back, puts in another order or puts in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gnss_hil.dbc.common.arrays import Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat
from gnss_hil.emulator.faults.base import Now, Rows, Sleeper, streams_of
from gnss_hil.emulator.faults.protect import Memory, Protection, no_memory, protect, remembers


@dataclass(frozen=True, slots=True)
class Drop(Sleeper):
    """An action: frames do not come."""

    def fresh(self) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, rows: Rows, now: Now) -> tuple[None, FrameBatch, int]:
        if not rows.hit.any():
            return None, frames, 0
        return None, frames[~rows.hit], int(rows.hit.sum())


@dataclass(frozen=True, slots=True, eq=False)
class Repeat:
    """An action: frames come again, at once or at the end of the block.

    again   what becomes of the header of the repetitions
    """

    codec: Codec
    copies: int
    at_end: bool
    again: Protection

    def fresh(self) -> Memory:
        return no_memory(self.codec)

    def sleeps(self, memory: Memory, /) -> bool:
        return not remembers(self.again)

    def step(
        self, memory: Memory, frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[Memory, FrameBatch, int]:
        times = np.where(rows.hit, 1 + self.copies, 1)
        if self.at_end:
            order = np.concatenate((np.arange(len(frames)), np.tile(np.flatnonzero(rows.hit), self.copies)))
            copied = np.arange(len(order)) >= len(frames)
        else:
            order = np.repeat(np.arange(len(frames)), times)
            copied = np.diff(order, prepend=-1) == 0
        out = frames[order]
        made = Rows(rows.placed[order], copied)
        memory, out = protect(self.again, memory, out, out, made, now)
        return memory, out, int(copied.sum())


@dataclass(frozen=True, slots=True)
class Delay:
    """An action: frames come epochs later, behind those of the epoch then: each so many, or drawn from 0 to
    so many."""

    epochs: int
    drawn: bool

    def fresh(self) -> tuple[tuple[int, FrameBatch], ...]:
        return ()

    def sleeps(self, held: tuple[tuple[int, FrameBatch], ...], /) -> bool:
        return not held

    def step(
        self, held: tuple[tuple[int, FrameBatch], ...], frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[Any, FrameBatch, int]:
        epoch = now.at.epoch
        due = [batch for when, batch in held if when <= epoch]
        kept = [(when, batch) for when, batch in held if when > epoch]
        later = np.where(rows.hit, self.epochs, 0)
        if self.drawn and rows.hit.any():
            later = np.where(rows.hit, np.floor(now.uniform("delay", len(frames)) * (self.epochs + 1)), 0)
        held_now = later > 0
        kept += [(epoch + int(by), frames[later == by]) for by in np.unique(later[held_now]).tolist()]
        out = frames[~held_now] if held_now.any() else frames
        stamped = [replace(batch, t_ns=np.full(len(batch), now.at.t_ns)) for batch in due]
        return tuple(kept), concat([out, *stamped]), int(held_now.sum())


@dataclass(frozen=True, slots=True)
class Shuffle(Sleeper):
    """An action: frames change places among themselves, drawn or from last to first."""

    backwards: bool

    def fresh(self) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, rows: Rows, now: Now) -> tuple[None, FrameBatch, int]:
        at = np.flatnonzero(rows.hit)
        if len(at) < 2:
            return None, frames, 0
        order = np.arange(len(frames))
        order[at] = at[::-1] if self.backwards else at[np.argsort(now.words("order", len(at)), kind="stable")]
        return None, frames[order], int((order != np.arange(len(frames))).sum())


@dataclass(frozen=True, slots=True, eq=False)
class Readdress:
    """An action: frames come under another identifier, its bits under a mask."""

    codec: Codec
    identifier: int
    mask: int
    protection: Protection

    def fresh(self) -> Memory:
        return no_memory(self.codec)

    def sleeps(self, memory: Memory, /) -> bool:
        return not remembers(self.protection)

    def step(
        self, memory: Memory, frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[Memory, FrameBatch, int]:
        if not rows.hit.any():
            return memory, frames, 0
        can_id = frames.can_id.copy()
        can_id[rows.hit] = (can_id[rows.hit] & np.uint32(~self.mask & 0x7FF)) | np.uint32(self.identifier)
        moved = replace(frames, can_id=can_id)
        memory, moved = protect(self.protection, memory, moved, moved, rows, now)
        return memory, moved, int(rows.hit.sum())


@dataclass(frozen=True, slots=True, eq=False)
class Insert(Sleeper):
    """An action: frames that nobody of the bus has sent, so many an epoch, at the block's end or beginning.

    frame   one, unprotected; protected by a sender of its own where `sealed`
    """

    codec: Codec
    frame: FrameBatch
    count: int
    first: bool
    sealed: bool

    def fresh(self) -> int:
        return 0

    def step(self, sent: int, frames: FrameBatch, rows: Rows, now: Now) -> tuple[int, FrameBatch, int]:
        if not now.active:
            return sent, frames, 0
        added = (
            sealed(self.frame, self.count, sent, now) if self.sealed else _many(self.frame, self.count, now)
        )
        pieces = (added, frames) if self.first else (frames, added)
        return sent + self.count, concat(pieces), self.count


def _many(frame: FrameBatch, count: int, now: Now) -> FrameBatch:
    many = frame[np.zeros(count, np.intp)]
    return replace(many, t_ns=np.full(count, now.at.t_ns))


def sealed(frames: FrameBatch, count: int, sent: int, now: Now) -> FrameBatch:
    """A frame, or one of each (n,), so many times, by a sender that has sent so many of each: with counter,
    epoch and a valid CRC."""
    from gnss_hil.dbc.contract import e2e

    out = _many(frames, count, now) if len(frames) == 1 else frames
    data = out.data.copy()
    turn = sent + (np.arange(len(out)) if len(frames) == 1 else 0)
    data[:, 1] = turn % e2e.COUNTERS | (now.at.epoch % 16) << 4
    data[:, 0] = e2e.crc(out.can_id, data)
    return replace(out, data=data)


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """An action: in the place of what is sent comes what was sent epochs before, at the place of the first.

    A window that has not been heard yet replaces nothing. again: what becomes of the headers.
    """

    codec: Codec
    lag: int
    again: Protection

    def fresh(self) -> tuple[tuple[FrameBatch, ...], Memory]:
        return (), no_memory(self.codec)

    def sleeps(self, state: tuple[tuple[FrameBatch, ...], Memory], /) -> bool:
        return False  # it listens

    def step(
        self, state: tuple[tuple[FrameBatch, ...], Memory], frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[Any, FrameBatch, int]:
        past, memory = state
        old = past[0] if len(past) == self.lag else EMPTY
        past = (*past[-(self.lag - 1) :], frames[rows.placed]) if self.lag > 1 else (frames[rows.placed],)
        if not (now.active and len(old)):
            memory, frames = protect(
                self.again, memory, frames, frames, Rows(rows.placed, _none(frames)), now
            )
            return (past, memory), frames, 0
        if not np.array_equal(rows.hit, rows.placed):
            hit = frames[rows.hit]
            wanted = set(zip(hit.can_id.tolist(), streams_of(self.codec, hit).tolist(), strict=True))
            every = zip(old.can_id.tolist(), streams_of(self.codec, old).tolist(), strict=True)
            old = old[np.array([one in wanted for one in every], bool)]
        at = int(np.argmax(rows.hit)) if rows.hit.any() else len(frames)
        old = replace(old, t_ns=np.full(len(old), now.at.t_ns))
        head, tail = frames[:at], frames[at:][~rows.hit[at:]]
        out = concat((head, old, tail))
        replayed = np.zeros(len(out), bool)
        replayed[len(head) : len(head) + len(old)] = True
        memory, out = protect(self.again, memory, out, out, Rows(replayed, replayed), now)
        return (past, memory), out, len(old)


def _none(frames: FrameBatch) -> Bool:
    return np.zeros(len(frames), bool)
