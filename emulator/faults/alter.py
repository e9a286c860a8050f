"""Frames whose content a fault changes: the content, then the protection over it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from gnss_hil.dbc.common.arrays import U64, Bool
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.emulator.faults.base import Fits, Now, Rows, Sleeper, streams_of
from gnss_hil.emulator.faults.protect import Memory, Protection, no_memory, protect, remembers
from gnss_hil.emulator.faults.signals import Held, nothing_held, with_words

HEADER = np.uint64(0xFFFF)
"""CRC, counter and epoch in a payload as a little-endian word."""


class Content(Protocol):
    """What a fault makes of payloads; it leaves the header to the protection."""

    def fresh(self, codec: Codec) -> Any: ...

    def step(self, state: Any, frames: FrameBatch, hit: Bool, now: Now, /) -> tuple[Any, U64]:
        """State, and payloads (n,) of an epoch's frames, changed at most where hit."""
        ...

    def clipped(self, state: Any, /) -> int:
        """How many frames of the last epoch carry the nearest value that they can, in place of another."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Alter:
    """An action: frames keep their place and identifier, and carry something else.

    only_changed   frames that the content leaves as they are count as not struck
    """

    codec: Codec
    content: Content
    protection: Protection
    only_changed: bool = True

    def fresh(self) -> tuple[Any, Memory]:
        return self.content.fresh(self.codec), no_memory(self.codec)

    def clipped(self, state: tuple[Any, Memory], /) -> int:
        """How many frames of the last epoch carry the nearest value that they can, in place of another."""
        return self.content.clipped(state[0])

    def sleeps(self, state: tuple[Any, Memory], /) -> bool:
        return not remembers(self.protection)

    def step(
        self, state: tuple[Any, Memory], frames: FrameBatch, rows: Rows, now: Now
    ) -> tuple[tuple[Any, Memory], FrameBatch, int]:
        content, memory = state
        content, words = self.content.step(content, frames, rows.hit, now)
        hit = rows.hit & (words != frames.words) if self.only_changed else rows.hit
        altered = with_words(frames, words) if hit.any() else frames
        memory, altered = protect(self.protection, memory, frames, altered, Rows(rows.placed, hit), now)
        return (content, memory), altered, int(hit.sum())


@dataclass(frozen=True, slots=True, eq=False)
class Same(Fits):
    """Content that is left as it is: header faults."""

    def fresh(self, codec: Codec) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, hit: Bool, now: Now) -> tuple[None, U64]:
        return None, frames.words


def payload_bits(codec: Codec) -> U64:
    """(2048,) bits of each identifier's payload that are neither header nor the key of its stream."""
    key = codec.key_mask_of << codec.key_shift_of
    return ~(HEADER | key)


@dataclass(frozen=True, slots=True, eq=False)
class Frozen(Fits):
    """Content that stays as it was in the first frame of each stream since the window began."""

    bits: U64

    def fresh(self, codec: Codec) -> Held:
        return nothing_held(codec)

    def step(self, held: Held, frames: FrameBatch, hit: Bool, now: Now) -> tuple[Held, U64]:
        words, held = frames.words.copy(), held.within(now)
        rows = np.flatnonzero(hit)
        if len(rows):
            stream = streams_of(now.codec, frames[rows])
            held = held.first(stream, words[rows])
            bits = self.bits[frames.can_id[rows] & 0x7FF]
            words[rows] = (words[rows] & ~bits) | (held.words[stream] & bits)
        return held, words


@dataclass(frozen=True, slots=True, eq=False)
class Noise(Fits):
    """Content that is anything, anew in each frame."""

    bits: U64

    def fresh(self, codec: Codec) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, hit: Bool, now: Now) -> tuple[None, U64]:
        words = frames.words.copy()
        rows = np.flatnonzero(hit)
        bits = self.bits[frames.can_id[rows] & 0x7FF]
        words[rows] = (words[rows] & ~bits) | (now.words("payload", len(rows)) & bits)
        return None, words


@dataclass(frozen=True, slots=True, eq=False)
class Flipped(Fits):
    """Content with bits turned over: so many of the payload's 64 [header included], drawn for each frame, or
    those of a mask."""

    count: int
    mask: int | None

    def fresh(self, codec: Codec) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, hit: Bool, now: Now) -> tuple[None, U64]:
        words = frames.words.copy()
        rows = np.flatnonzero(hit)
        if self.mask is not None:
            words[rows] ^= np.uint64(self.mask)
        elif len(rows):
            bits = 8 * frames.length[rows].astype(np.int64)
            drawn = now.uniform("bits", len(rows) * 64).reshape(-1, 64)
            drawn[np.arange(64) >= bits[:, None]] = 2.0
            chosen = np.argsort(drawn, axis=1)[:, : self.count]
            flips = np.bitwise_or.reduce(np.uint64(1) << chosen.astype(np.uint64), axis=1)
            words[rows] ^= flips & _within(bits)
        return None, words


def _within(bits: Any) -> U64:
    """(n,) words with the lowest bits (n,) set."""
    whole = np.uint64(0xFFFF_FFFF_FFFF_FFFF)
    return np.where(
        bits >= 64, whole, (np.uint64(1) << np.minimum(bits, 63).astype(np.uint64)) - np.uint64(1)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Shorten(Sleeper):
    """An action: frames of another length."""

    length: int

    def fresh(self) -> None:
        return None

    def step(self, state: None, frames: FrameBatch, rows: Rows, now: Now) -> tuple[None, FrameBatch, int]:
        if not rows.hit.any():
            return None, frames, 0
        length, data = frames.length.copy(), frames.data.copy()
        length[rows.hit] = self.length
        data[rows.hit, self.length :] = 0
        return None, replace(frames, length=length, data=data), int(rows.hit.sum())
