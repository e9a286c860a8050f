"""What becomes of CRC, counter and epoch of a frame that a fault has altered, and of the counter after it.

    protection = "recompute"     a CRC that is valid: the receiver cannot see the change (the default)
    protection = "keep"          the header as it was: a CRC that is wrong where the payload changed
    protection = "wrong"         a CRC that is wrong, whatever the payload
    protection = {crc = "recompute", counter = "freeze", after = "last-value"}

The ways are those of CANoe's test modules for protected messages: value, freeze, random, offset; and what
comes after the fault: the counter that the sender would have (`correct`), the one after the last that was
valid (`last-valid`), the one after the last that was sent (`last-value`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gnss_hil.dbc.common.arrays import I64, U8, Bool, Index
from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.emulator.faults.base import Now, Rows, known, ranks, streams_of
from gnss_hil.emulator.faults.spoken import Spoken

Way = Literal["keep", "recompute", "wrong", "value", "freeze", "random", "offset"]
SHORT = ("recompute", "keep", "wrong")
_BEYOND = screening.MAX_DELTA + 4
"""A counter that is wrong is ahead by this: no receiver takes it for frames that were lost."""


class Protection(Spoken):
    """CRC, counter and epoch of altered frames. One word stands for the CRC, the counter kept.

    crc            recompute: valid; keep: as it was; wrong: never valid; value; freeze: that of the first
                   altered frame of each stream; random; offset: the valid one plus crc_by
    crc_by         the value or the offset
    counter        keep: the sender's; recompute: one on from the last that left; wrong: far ahead; value;
                   freeze: that of the first altered frame of each stream; random; offset
    counter_by     the value or the offset
    epoch          of the epoch modulo 16: keep, or recompute: that of the epoch at hand
    after          the counter behind the fault: correct, last-valid, last-value
    """

    crc: Way = "recompute"
    crc_by: Annotated[int, Field(ge=0, le=255)] = 0
    counter: Way = "keep"
    counter_by: Annotated[int, Field(ge=0, le=15)] = 0
    epoch: Literal["keep", "recompute"] = "keep"
    after: Literal["correct", "last-valid", "last-value"] = "correct"

    @classmethod
    def _read(cls, text: str) -> dict[str, Any]:
        if text not in SHORT:
            raise ValueError(f"'{text}' is no protection; one of {', '.join(SHORT)}, or a table")
        return {"crc": text}


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """Of each stream (streams,), -1 for none yet.

    valid, sent    the last valid counter that was not struck, and the last that left
    counter, crc   what freezes
    struck         whether the last frame was
    shift          by how much counters behind a fault are ahead of the sender's
    """

    valid: I64
    sent: I64
    counter: I64
    crc: I64
    struck: Bool
    shift: I64


def no_memory(codec: Codec) -> Memory:
    """Before the first epoch."""
    none = np.full(codec.streams, -1)
    return Memory(none, none, none, none, np.zeros(codec.streams, bool), np.zeros(codec.streams, np.int64))


def protect(
    how: Protection, memory: Memory, before: FrameBatch, altered: FrameBatch, rows: Rows, now: Now
) -> tuple[Memory, FrameBatch]:
    """Headers of an epoch's frames, altered (n,) from before (n,) where `rows.hit`; what they leave behind.

    Frames that are not of the contract, or not of eight bytes, have no header.
    """
    mine = rows.placed & known(now.codec, altered)
    if not mine.any():
        return memory, altered
    data = altered.data.copy()
    if remembers(how):
        memory = _unstruck(how, memory, altered, data, np.flatnonzero(mine & ~rows.hit), now)
    memory = _struck(how, memory, before, data, np.flatnonzero(mine & rows.hit), now)
    return memory, replace(altered, data=data)


def remembers(how: Protection) -> bool:
    """Whether frames that are not struck matter."""
    return how.after != "correct" or how.counter in ("recompute", "freeze") or how.crc == "freeze"


def _unstruck(how: Protection, memory: Memory, frames: FrameBatch, data: U8, at: Index, now: Now) -> Memory:
    """Frames that are not struck: their counters go on from where `after` says. In place."""
    if not len(at):
        return memory
    stream = streams_of(now.codec, frames[at])
    own = (data[at, 1] & 15).astype(np.int64)
    ending = memory.struck[stream] & (ranks(stream) == 0)
    shift, counter, crc = memory.shift.copy(), memory.counter.copy(), memory.crc.copy()
    if how.after != "correct":
        base = (memory.valid if how.after == "last-valid" else memory.sent)[stream]
        begins = ending & (base >= 0)
        shift[stream[begins]] = (base[begins] + 1 - own[begins]) % e2e.COUNTERS
    counter[stream[ending]] = crc[stream[ending]] = -1
    ahead = shift[stream]
    moved = np.where(ahead != 0, (own + ahead) % e2e.COUNTERS, own)
    rows = at[ahead != 0]
    data[rows, 1] = (data[rows, 1] & 0xF0) | moved[ahead != 0]
    data[rows, 0] = e2e.crc(frames.can_id[rows], data[rows])
    valid, sent, struck = memory.valid.copy(), memory.sent.copy(), memory.struck.copy()
    valid[stream] = sent[stream] = moved
    struck[stream] = False
    return Memory(valid, sent, counter, crc, struck, shift)


def _struck(how: Protection, memory: Memory, before: FrameBatch, data: U8, at: Index, now: Now) -> Memory:
    """Frames that are struck: counter, epoch, CRC. In place."""
    if not len(at):
        return memory
    stream = streams_of(now.codec, before[at])
    own, came = (data[at, 1] & 15).astype(np.int64), data[at, 0].astype(np.int64)
    shifted = np.where(memory.shift[stream] != 0, (own + memory.shift[stream]) % e2e.COUNTERS, own)
    held = _first(memory.counter, stream, shifted) if how.counter == "freeze" else memory.counter
    live = np.where(memory.sent[stream] >= 0, memory.sent[stream] + 1 + ranks(stream), shifted)
    counter = _BY_WAY[how.counter](shifted, live, held[stream], how.counter_by, now, "counter") & 15
    nibble = np.full(len(at), now.at.epoch % 16) if how.epoch == "recompute" else data[at, 1] >> 4
    data[at, 1] = counter | nibble.astype(np.int64) << 4
    valid = e2e.crc(before.can_id[at], data[at]).astype(np.int64)
    kept = _first(memory.crc, stream, valid) if how.crc == "freeze" else memory.crc
    data[at, 0] = _CRC[how.crc](came, valid, kept[stream], how.crc_by, now)
    if not remembers(how):
        return memory
    sent, struck = memory.sent.copy(), memory.struck.copy()
    sent[stream], struck[stream] = counter, True
    return replace(memory, sent=sent, struck=struck, counter=held, crc=kept)


def _first(held: I64, stream: I64, values: I64) -> I64:
    """What is held of each stream, with the first value (n,) of those that have none yet."""
    new = held[stream] < 0
    if not new.any():
        return held
    unique, place = np.unique(stream[new], return_index=True)
    found = held.copy()
    found[unique] = values[new][place]
    return found


_BY_WAY: dict[str, Callable[..., I64]] = {
    "keep": lambda own, live, held, by, now, what: own,
    "recompute": lambda own, live, held, by, now, what: live % e2e.COUNTERS,
    "wrong": lambda own, live, held, by, now, what: (own + _BEYOND) % e2e.COUNTERS,
    "value": lambda own, live, held, by, now, what: np.full(len(own), by),
    "freeze": lambda own, live, held, by, now, what: held,
    "random": lambda own, live, held, by, now, what: _drawn(now, what, len(own), e2e.COUNTERS),
    "offset": lambda own, live, held, by, now, what: (own + by) % e2e.COUNTERS,
}
"""Counters (n,) of the sender, one on from the last that left, and frozen -> counters."""

_CRC: dict[str, Callable[..., I64]] = {
    "keep": lambda own, valid, held, by, now: own,
    "recompute": lambda own, valid, held, by, now: valid,
    "wrong": lambda own, valid, held, by, now: valid ^ 0xFF,
    "value": lambda own, valid, held, by, now: np.full(len(own), by),
    "freeze": lambda own, valid, held, by, now: held,
    "random": lambda own, valid, held, by, now: _drawn(now, "crc", len(own), 256),
    "offset": lambda own, valid, held, by, now: (valid + by) & 0xFF,
}
"""CRCs (n,) as they came, valid, and frozen -> CRCs."""


def _drawn(now: Now, what: str, count: int, below: int) -> I64:
    return (now.words(what, count) % np.uint64(below)).astype(np.int64)
