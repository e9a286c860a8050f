"""What a fault makes of signals, by their names in the DBC and in physical units, on whole batches.

As text, in a one-liner or a file:

    RANGE.pseudorange_m += 30      offset;  -= 30;  *= 1.001  scale
    RATE.cn0_dbhz = 20             value; a label of a value table too: SV_Z.health = UNHEALTHY
    pseudorange_m += 2/s           drift, from 0 at the window's beginning on
    ATT_Q01.q0 freeze              as it was in the first frame of each stream
    NAV_STATUS.pdop random         anything that the signal can carry

A signal without a message is that of every message at the fault's place that has one of the name. What its
signal cannot carry is sent as the nearest value that it can.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from gnss_hil.dbc.common.arrays import F64, I64, U64, Bool
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.contract.codec import Codec, Layout
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch
from gnss_hil.dbc.contract.layout import Kind, Signal
from gnss_hil.dbc.contract.messages import HEADER_NAMES, KIND_BY_NAME, KINDS, messages
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.emulator.faults.base import Now, streams_of
from gnss_hil.emulator.faults.spoken import Spoken

_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_CHANGE = re.compile(
    rf"(?P<signal>\w+(?:\.\w+)?)\s*(?:(?P<op>[-+*]?=)\s*(?P<value>{_NUMBER}|[A-Z][A-Z0-9_]*)(?P<rate>/s)?"
    r"|(?P<word>freeze|random))"
)
Number = Annotated[float, Field(ge=-1e15, le=1e15)]
WAYS = ("value", "offset", "scale", "drift_per_s", "freeze", "random")


class Change(Spoken):
    """One signal, and one of the ways to change it. Text, such as "RANGE.pseudorange_m += 30", is read as
    well.

    signal        MESSAGE.signal, or a signal of every message at the place
    value         a number in the signal's unit, or a label of its value table
    offset        added
    scale         multiplied
    drift_per_s   added for each second since the window began
    freeze        stays as it was in the first frame of each stream
    random        anything that the signal can carry, anew in each frame
    """

    signal: str
    value: Number | str | None = None
    offset: Number | None = None
    scale: Number | None = None
    drift_per_s: Number | None = None
    freeze: bool = False
    random: bool = False

    @classmethod
    def _read(cls, text: str) -> dict[str, Any]:
        return parse(text)

    @model_validator(mode="after")
    def _is_one_way(self):
        values = {name: getattr(self, name) for name in WAYS}
        given = [name for name, value in values.items() if value is not None and value is not False]
        if len(given) != 1:
            raise ValueError(f"one of {', '.join(WAYS)}; given {' and '.join(given) or 'none'}")
        kinds = self.kinds()
        if len(kinds) == 1:
            self.check(kinds[0])
        if self.offset == 0 or self.scale == 1 or self.drift_per_s == 0:
            raise ValueError(f"signal {self.signal}: that changes nothing")
        if isinstance(self.value, str):
            tables = {s.values for kind in kinds for s in kind.signals if s.name == self._name}
            labels = [label for table in tables for label in VALUES.get(table, {}).values()]
            if self.value not in labels:
                raise ValueError(
                    f"signal {self.signal} has no value '{self.value}'; {_meant(self.value, labels)}"
                )
        return self

    def check(self, kind: Kind) -> None:
        """ValueError if a message of this kind cannot carry the value, or none that it carries stays one with
        the offset."""
        signal = next(one for one in kind.signals if one.name == self._name)
        low, high = limits(signal)
        carries = f"signal {kind.name}.{signal.name} carries {low:.12g} to {high:.12g}"
        if isinstance(self.value, int | float) and not _fits(signal, self.value):
            raise ValueError(f"{carries}, found {self.value:.12g}")
        if self.offset is not None and abs(self.offset) > high - low:
            raise ValueError(f"{carries}; an offset of {self.offset:.12g} leads out of that from anywhere")

    @property
    def _name(self) -> str:
        return self.signal.rpartition(".")[2]

    def kinds(self) -> list[Kind]:
        """Kinds of messages that have the signal; ValueError if none has."""
        message, _, name = self.signal.rpartition(".")
        kinds = [KIND_BY_NAME[kind] for kind in _kinds_of(message)] if message else list(KINDS)
        found = [kind for kind in kinds if name in [s.name for s in kind.signals]]
        if not found:
            known = {s.name for kind in kinds for s in kind.signals} - HEADER_NAMES
            of = f"message {message} has no signal" if message else "no message has a signal"
            raise ValueError(f"{of} '{name}'; {did_you_mean(name, sorted(known))}")
        if name in HEADER_NAMES:
            raise ValueError(
                f"signal {self.signal}: CRC, counter and epoch are the protection's: protection = ..."
            )
        return found


def _raw_limits(signal: Signal) -> tuple[int, int]:
    half = 1 << (signal.bits - 1)
    return (-half, half - 1) if signal.signed else (0, 2 * half - 1)


def limits(signal: Signal) -> tuple[float, float]:
    """The lowest and highest value that a signal's bits can carry, in its unit."""
    low, high = (float(raw) * signal.factor + signal.offset for raw in _raw_limits(signal))
    return low, high


def _fits(signal: Signal, value: float) -> bool:
    low, high = _raw_limits(signal)
    return low <= round((value - signal.offset) / signal.factor) <= high


def _meant(value: str, labels: Sequence[str]) -> str:
    return did_you_mean(value, labels) if labels else "its values have no labels; give a number"


def _kinds_of(message: str) -> list[str]:
    """Kinds that a message's name stands for: its own, or that of RX2_RANGE."""
    upper = message.upper()
    if upper in KIND_BY_NAME:
        return [upper]
    named = {m.name: m.kind.name for m in messages(8)}
    if upper not in named:
        raise ValueError(f"no message '{message}'; {did_you_mean(message, [*KIND_BY_NAME, *named])}")
    return [named[upper]]


def parse(text: str) -> dict[str, Any]:
    """Keys of a `Change` from text; ValueError if it is none."""
    match = _CHANGE.fullmatch(text.strip())
    if match is None:
        raise ValueError(
            f"'{text}' is no change; SIGNAL = 5, SIGNAL += 5, SIGNAL *= 2, SIGNAL += 5/s, SIGNAL freeze, "
            "SIGNAL random"
        )
    signal, op, value, rate, word = match.group("signal", "op", "value", "rate", "word")
    if word:
        return {"signal": signal, word: True}
    label = not re.fullmatch(_NUMBER, value)
    if rate or label:
        if label and (rate or op != "="):
            raise ValueError(f"'{text}': a label goes with =")
        if rate and op not in ("+=", "-="):
            raise ValueError(f"'{text}': a rate goes with += or -=")
    if label:
        return {"signal": signal, "value": value}
    number = -float(value) if op == "-=" else float(value)
    return {"signal": signal, "drift_per_s" if rate else _KEY[op]: number}


_KEY = {"=": "value", "+=": "offset", "-=": "offset", "*=": "scale"}


def text(change: Change) -> str:
    """A change in words that `parse` reads."""
    for key, op in (("value", "="), ("offset", "+="), ("scale", "*="), ("drift_per_s", "+=")):
        given = getattr(change, key)
        if given is not None:
            said = given if isinstance(given, str) else repr(given)
            return f"{change.signal}{op}{said}{'/s' if key == 'drift_per_s' else ''}"
    return f"{change.signal} {'freeze' if change.freeze else 'random'}"


def physical(layout: Layout, signal: str, words: U64) -> F64:
    """(n,) a signal of payloads in its unit."""
    return layout.signal(signal, words).astype(np.float64)


def with_signal(layout: Layout, signal: str, words: U64, values: F64 | I64) -> U64:
    """(n,) payloads with a signal set to values [its unit], the nearest that it can carry."""
    i, raw = layout.signals.index(signal), _raw(layout, signal, values)
    return with_raw(
        layout, signal, words, np.clip(raw, layout.raw_min[i], layout.raw_max[i]).astype(np.int64)
    )


def _raw(layout: Layout, signal: str, values: F64 | I64) -> F64:
    i = layout.signals.index(signal)
    return np.rint((np.asarray(values, np.float64) - layout.offset[i]) / layout.factor[i])


def misfits(layout: Layout, signal: str, values: F64 | I64) -> int:
    """How many values a signal cannot carry."""
    i, raw = layout.signals.index(signal), _raw(layout, signal, values)
    return int(np.count_nonzero((raw < layout.raw_min[i]) | (raw > layout.raw_max[i])))


def with_raw(layout: Layout, signal: str, words: U64, raw: I64) -> U64:
    """(n,) payloads with a signal's bits."""
    i = layout.signals.index(signal)
    field = layout.mask[i] << layout.shift[i]
    return (words & ~field) | ((raw.view(np.uint64) & layout.mask[i]) << layout.shift[i])


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """Words that freeze: by stream (streams,), and which of them are there yet; since which window."""

    words: U64
    there: Bool
    since: int = -1

    def within(self, now: Now) -> Held:
        """Itself, or nothing where another window has begun."""
        return self if self.since == now.since else replace(nothing_held(now.codec), since=now.since)

    def first(self, stream: I64, words: U64) -> Held:
        """With the first word of each stream (n,) that has none yet."""
        new = ~self.there[stream]
        if not new.any():
            return self
        unique, at = np.unique(stream[new], return_index=True)
        held, there = self.words.copy(), self.there.copy()
        held[unique], there[unique] = words[new][at], True
        return Held(held, there, self.since)


def nothing_held(codec: Codec) -> Held:
    return Held(np.zeros(codec.streams, np.uint64), np.zeros(codec.streams, bool))


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """Of changes: words that freeze, of each; how many frames of the last epoch were clipped."""

    held: tuple[Held, ...]
    clipped: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Changed:
    """Content (`gnss_hil.emulator.faults.alter`): changes of signals, one after the other."""

    changes: tuple[Change, ...]
    tables: tuple[tuple[tuple[Layout, Bool], ...], ...]

    def fresh(self, codec: Codec) -> Kept:
        return Kept(tuple(nothing_held(codec) for _ in self.changes))

    def clipped(self, state: Kept, /) -> int:
        return state.clipped

    def step(self, state: Kept, frames: FrameBatch, hit: Bool, now: Now, /) -> tuple[Kept, U64]:
        """Held words and the payloads (n,) of an epoch, changed where hit."""
        words, clipped = frames.words.copy(), 0
        kept = [one.within(now) for one in state.held]
        for number, (change, rows_of) in enumerate(zip(self.changes, self.tables, strict=True)):
            for layout, identifiers in rows_of:
                rows = np.flatnonzero(hit & identifiers[frames.can_id & SFF_MASK])
                if len(rows):
                    part = words[rows]
                    kept[number], words[rows], beyond = _one(
                        change, layout, kept[number], frames[rows], part, now
                    )
                    clipped += beyond
        return Kept(tuple(kept), clipped), words


def _one(
    change: Change, layout: Layout, held: Held, frames: FrameBatch, words: U64, now: Now
) -> tuple[Held, U64, int]:
    """One change on frames of one kind; how many values no bits can carry."""
    name = change.signal.rpartition(".")[2]
    i = layout.signals.index(name)
    if change.freeze:
        stream = streams_of(now.codec, frames)
        held = held.first(stream, words)
        field = layout.mask[i] << layout.shift[i]
        return held, (words & ~field) | (held.words[stream] & field), 0
    if change.random:
        drawn = now.words(f"random {layout.name}.{name}", len(words)) & layout.mask[i]
        return held, with_raw(layout, name, words, drawn.view(np.int64)), 0
    if isinstance(change.value, str):
        table = next(s.values for s in KIND_BY_NAME[layout.name].signals if s.name == name)
        raw = next(raw for raw, label in VALUES[table].items() if label == change.value)
        return held, with_signal(layout, name, words, np.full(len(words), raw)), 0
    if change.value is not None:
        return held, with_signal(layout, name, words, np.full(len(words), change.value)), 0
    before = physical(layout, name, words)
    drift = (change.drift_per_s or 0.0) * now.elapsed_s
    scale = 1.0 if change.scale is None else change.scale
    after = before * scale + (change.offset or 0.0) + drift
    return held, with_signal(layout, name, words, after), misfits(layout, name, after)


def changed(changes: Sequence[Change], codec: Codec, identifiers: Bool) -> Changed:
    """Changes of signals at a place of these identifiers (2048,); ValueError if none of its messages has
    one."""
    every = list(messages(codec.receivers))
    tables = []
    for change in changes:
        message, _, name = change.signal.upper().rpartition(".")
        rows: dict[str, Bool] = {}
        for m in every:
            has = name.lower() in [s.name for s in m.kind.signals]
            if has and identifiers[m.can_id] and message in ("", m.name, m.kind.name):
                rows.setdefault(m.kind.name, np.zeros(len(identifiers), bool))[m.can_id] = True
        for kind in rows:
            change.check(KIND_BY_NAME[kind])
        if not rows:
            raise ValueError(f"change: no message at the place has {change.signal}")
        tables.append(tuple((codec.kinds[kind], table) for kind, table in rows.items()))
    return Changed(tuple(changes), tuple(tables))


def with_words(frames: FrameBatch, words: U64) -> FrameBatch:
    """Frames with other payloads."""
    return replace(frames, data=words.astype("<u8", copy=False).view(np.uint8).reshape(-1, 8))
