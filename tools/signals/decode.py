"""Frames of any messages decoded at once: cantools says what a signal is, arrays do the arithmetic."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.counts import so_many
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, FrameBatch
from gnss_hil.tools.signals.database import Database, Message, Signal

_FLOATS = {16: "f2", 32: "f4", 64: "f8"}
_WORDS = {16: "u2", 32: "u4", 64: "u8"}


@dataclass(slots=True)
class Undecoded:
    """Frames that are left out.

    unknown   by identifier: the database does not have it
    short     by message: shorter than it
    other     by kind: error and remote frames
    selected  by multiplexer: values of it that no signal belongs to; what does not depend on it is decoded
    """

    unknown: Counter[int] = field(default_factory=Counter)
    short: Counter[str] = field(default_factory=Counter)
    other: Counter[str] = field(default_factory=Counter)
    selected: Counter[str] = field(default_factory=Counter)

    def remarks(self, database: Database) -> list[str]:
        """In lines."""
        lines = [
            f"{so_many(count, f'{kind[:-1]} has', f'{kind} have')} no signals"
            for kind, count in self.other.items()
            if count
        ]
        if self.unknown:
            names = [_id(can_id) for can_id, _ in self.unknown.most_common(5)]
            more = "" if len(self.unknown) <= 5 else f" and {len(self.unknown) - 5} more"
            many = so_many(self.unknown.total(), "frame is", "frames are")
            lines.append(
                f"{many} of identifiers that {database.path} does not have: {', '.join(names)}{more}"
            )
        lines += [
            f"{so_many(count, 'frame is', 'frames are')} shorter than {name}"
            for name, count in self.short.items()
        ]
        lines += [
            f"{so_many(count, 'frame has', 'frames have')} a value of {name} that no signal belongs to"
            for name, count in self.selected.items()
        ]
        if database.left_out:
            lines.append(
                f"{database.path}: signals that do not lie in their messages: {', '.join(database.left_out)}"
            )
        return lines


def _id(can_id: int) -> str:
    return f"{can_id & EFF_MASK:X}{'x' if can_id & EFF_FLAG else ''}"


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """Values of a signal in k frames.

    values   (k,) physical, whole numbers where the signal's are
    raw      (k,) as they are in the payload
    present  (k,) whether the frame has the signal; None: all have
    """

    signal: Signal
    values: NDArray
    raw: NDArray[np.int64]
    present: NDArray[np.bool_] | None


def by_message(
    database: Database, frames: FrameBatch, undecoded: Undecoded
) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Which message, and rows (k,) of the frames that are of it, in their order."""
    can_id = frames.can_id
    error, remote = can_id & ERR_FLAG != 0, can_id & RTR_FLAG != 0
    undecoded.other.update({"error frames": int(error.sum()), "remote frames": int((remote & ~error).sum())})
    data = np.flatnonzero(~(error | remote))
    found, place = np.unique(can_id[data], return_inverse=True)
    order = np.argsort(place, kind="stable")
    edges = np.searchsorted(place[order], np.arange(len(found) + 1))
    for i, number in enumerate(found.tolist()):
        rows = data[order[edges[i] : edges[i + 1]]]
        at = database.by_id.get(number)
        if at is None:
            undecoded.unknown[number] += len(rows)
            continue
        message = database.messages[at]
        long = frames.length[rows] >= message.length
        if not long.all():
            undecoded.short[message.name] += int((~long).sum())
            rows = rows[long]
        if len(rows):
            yield at, rows


def columns(message: Message, words: NDArray[np.uint64], undecoded: Undecoded) -> list[Column]:
    """All signals of a message from the payloads (k,) of its frames, each one little-endian word."""
    swapped = words.byteswap() if any(s.swapped for s in message.signals) else words
    raws = [_bits(s, swapped if s.swapped else words) for s in message.signals]
    found = [
        Column(s, _physical(s, raws[i]), raws[i], _present(message, i, raws))
        for i, s in enumerate(message.signals)
    ]
    _count_unselected(message, found, undecoded)
    return found


def _bits(s: Signal, words: NDArray[np.uint64]) -> NDArray[np.int64]:
    """(k,) raw values, sign extended; unsigned ones of 64 bits as a signed word."""
    raw = words >> np.uint64(s.shift)
    if s.bits < 64:
        raw &= np.uint64((1 << s.bits) - 1)
    values = raw.view(np.int64)
    if s.signed and s.bits < 64 and not s.floating:
        sign = np.int64(1 << s.bits - 1)
        values = (values ^ sign) - sign
    return values


def _physical(s: Signal, raw: NDArray[np.int64]) -> NDArray:
    """(k,) values as cantools gives them: raw times factor plus offset."""
    if s.floating:
        values = raw.astype(_WORDS[s.bits]).view(_FLOATS[s.bits]).astype(float)
        return values if (s.factor, s.offset) == (1, 0) else values * s.factor + s.offset
    unsigned_word = s.bits == 64 and not s.signed
    number = raw.view(np.uint64) if unsigned_word else raw
    if s.whole:
        return number if (s.factor, s.offset) == (1, 0) else number * int(s.factor) + int(s.offset)
    return number.astype(float) * s.factor + s.offset


def _present(message: Message, number: int, raws: list[NDArray[np.int64]]) -> NDArray[np.bool_] | None:
    """(k,) whether each frame has a signal: its selector is there and has one of its values. None: all."""
    there, seen, s = None, set(), message.signals[number]
    while s.selector is not None and s.selector not in seen:
        seen.add(s.selector)
        mine = np.isin(raws[s.selector], s.selected)
        there = mine if there is None else there & mine
        s = message.signals[s.selector]
    return there


def _count_unselected(message: Message, found: list[Column], undecoded: Undecoded) -> None:
    for i, s in enumerate(message.signals):
        below = [column.signal.selected for column in found if column.signal.selector == i]
        if not below:
            continue
        known = np.isin(found[i].raw, sorted({value for values in below for value in values}))
        present = found[i].present
        strange = ~known if present is None else ~known & present
        if strange.any():
            undecoded.selected[f"{message.name}.{s.name}"] += int(strange.sum())
