"""Encode and decode batches of frames.

The table of messages gives shift, mask and scale, one row per *kind* (a layout that repeats per receiver
is one kind), and everything after that is array arithmetic. cantools is the authority for the layout: tests
hold the tables equal to what it reads from the DBC, for every number of receivers, and both directions equal
to its own for every message.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.generate import dbc_text
from gnss_hil.dbc.contract.layout import Kind
from gnss_hil.dbc.contract.messages import Message, messages

IDENTIFIERS = 2048


class CodecError(ValueError):
    """A value that its signal cannot carry."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Shift, mask and scale of one kind's signals; arrays (s,) over its signals in bit order."""

    name: str
    number: int
    signals: tuple[str, ...]
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    sign_bit: NDArray[np.int64]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]
    raw_min: NDArray[np.float64]
    raw_max: NDArray[np.float64]
    integral: tuple[bool, ...]
    key_shift: int
    key_mask: int

    def signal(self, name: str, words: NDArray[np.uint64]) -> NDArray:
        """(n,) one signal of payloads (n,) as little-endian words, as `Codec.decode` has it."""
        i = self.signals.index(name)
        raw = ((words >> self.shift[i]) & self.mask[i]).view(np.int64)
        if self.sign_bit[i]:
            raw ^= self.sign_bit[i]
            raw -= self.sign_bit[i]
        return raw if self.integral[i] else raw * self.factor[i] + self.offset[i]


@dataclass(frozen=True, slots=True, eq=False)
class Codec:
    """The contract as tables.

    kinds        layouts by name
    can_id_of    (kind name, number) -> identifier; number is the receiver's or node's, 0 otherwise
    kind_of      (2048,) int16 kind number by identifier, -1 unknown
    number_of    (2048,) int16 receiver or node number by identifier, 0 if the kind does not repeat
    sender_of    (2048,) names of the sending node, '' unknown
    key_shift_of, key_mask_of   (2048,) protection by identifier
    first_stream_of   (2048,) by identifier, the protected stream of its key 0; those of other keys follow
    streams      how many protected streams a bus can carry
    hash         first 4 bytes, big-endian, of SHA-256 of the DBC text
    """

    receivers: int
    text: str
    hash: int
    kinds: Mapping[str, Layout]
    layouts: tuple[Layout, ...]
    can_id_of: Mapping[tuple[str, int], int]
    kind_of: NDArray[np.int16]
    number_of: NDArray[np.int16]
    sender_of: tuple[str, ...]
    key_shift_of: NDArray[np.uint64]
    key_mask_of: NDArray[np.uint64]
    first_stream_of: NDArray[np.int64]
    streams: int

    def decode(self, kind: str, data: NDArray[np.uint8]) -> dict[str, NDArray]:
        """Signals of frames (n, 8) of one kind: name -> (n,), int64 where unscaled, else float64."""
        layout = self.kinds[kind]
        raw = _extract(layout, data)
        physical = raw * layout.factor + layout.offset
        return {
            name: raw[:, i] if layout.integral[i] else physical[:, i] for i, name in enumerate(layout.signals)
        }

    def encode(
        self, kind: str, values: Mapping[str, NDArray | float], n: int | None = None
    ) -> NDArray[np.uint8]:
        """Payloads (n, 8) from name -> (n,) or scalar, rounded half to even.

        Signals not named are zero (the protection header is filled in by
        `gnss_hil.dbc.contract.e2e.protect`). CodecError names the first value that does not fit, nan
        included.
        """
        plan = _plan(self.kinds[kind], tuple(values))
        if n is None:
            n = max(map(np.size, values.values()), default=1)
        scaled = np.empty((len(values), n))
        for row, value in zip(scaled, values.values(), strict=True):
            row[:] = value
        if plan.shifted:
            scaled -= plan.offset
        scaled /= plan.factor
        np.rint(scaled, out=scaled)
        with np.errstate(invalid="ignore"):  # nan and inf become the lowest integer, which never fits
            raw = scaled.astype(np.int64)
        if ((raw + plan.half) & plan.beyond).any():
            raise CodecError(_misfit(plan, scaled))
        raw &= plan.mask
        words = plan.weight @ raw
        return words.astype("<i8", copy=False).view(np.uint8).reshape(n, 8)

    def key_of(self, can_id: NDArray, data: NDArray[np.uint8]) -> NDArray[np.int64]:
        """(n,) number of the protected stream that each frame belongs to."""
        key = (_words(data) >> self.key_shift_of[can_id]) & self.key_mask_of[can_id]
        return self.first_stream_of[can_id] + key.astype(np.int64)


def _words(data: NDArray[np.uint8]) -> NDArray[np.uint64]:
    return np.ascontiguousarray(data).view("<u8")[:, 0]


def _extract(layout: Layout, data: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(n, s) raw integers, sign extended."""
    raw = ((_words(data)[:, None] >> layout.shift) & layout.mask).view(np.int64)
    return (raw ^ layout.sign_bit) - layout.sign_bit


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """Columns (s, 1) of a layout for the signals one caller encodes, in the caller's order.

    shifted whether any signal has an offset
    half    added to a raw value, turns its allowed range into 0 .. mask
    beyond  bits outside that range
    weight  (s,) 2^shift: fields are disjoint, so packing is a dot product modulo 2^64
    """

    layout: Layout
    rows: NDArray[np.intp]
    shifted: bool
    offset: NDArray[np.float64]
    factor: NDArray[np.float64]
    half: NDArray[np.int64]
    beyond: NDArray[np.int64]
    mask: NDArray[np.int64]
    weight: NDArray[np.int64]


@lru_cache(maxsize=512)
def _plan(layout: Layout, names: tuple[str, ...]) -> _Plan:
    rows = np.array([layout.signals.index(name) for name in names], np.intp)
    mask = layout.mask[rows, None].view(np.int64)
    return _Plan(
        layout=layout,
        rows=rows,
        shifted=bool(layout.offset[rows].any()),
        offset=layout.offset[rows, None],
        factor=layout.factor[rows, None],
        half=layout.sign_bit[rows, None],
        beyond=~mask,
        mask=mask,
        weight=(np.uint64(1) << layout.shift[rows]).view(np.int64),
    )


def _misfit(plan: _Plan, raw: NDArray[np.float64]) -> str:
    """The first value out of range, with the range."""
    layout = plan.layout
    low, high = layout.raw_min[plan.rows, None], layout.raw_max[plan.rows, None]
    i, j = np.argwhere(~((raw >= low) & (raw <= high)))[0]
    found, least, most = (
        x * layout.factor[plan.rows[i]] + layout.offset[plan.rows[i]]
        for x in (raw[i, j], low[i, 0], high[i, 0])
    )
    signal = layout.signals[plan.rows[i]]
    return f"{layout.name}.{signal} = {found:g} does not fit; allowed {least:g} to {most:g}"


def _layout(number: int, kind: Kind) -> Layout:
    signals = kind.signals
    bits = np.array([s.bits for s in signals])
    signed = np.array([s.signed for s in signals])
    top = 2.0 ** (bits - signed)
    key = next((s for s in signals if s.name == kind.key), None)
    return Layout(
        name=kind.name,
        number=number,
        signals=tuple(s.name for s in signals),
        shift=np.array([s.start for s in signals], np.uint64),
        mask=np.array([(1 << s.bits) - 1 for s in signals], np.uint64),
        sign_bit=np.array([1 << s.bits - 1 if s.signed else 0 for s in signals], np.int64),
        factor=np.array([float(s.factor) for s in signals]),
        offset=np.array([float(s.offset) for s in signals]),
        raw_min=np.where(signed, -top, 0.0),
        raw_max=top - 1,
        integral=tuple(s.factor == 1 and s.offset == 0 for s in signals),
        key_shift=key.start if key else 0,
        key_mask=(1 << key.bits) - 1 if key else 0,
    )


def of_messages(messages: Iterable[Message], text: str, receivers: int) -> Codec:
    """The codec of a table of messages, by identifier; `text` is the DBC that says the same."""
    kinds: dict[str, Layout] = {}
    can_id_of, senders = {}, [""] * IDENTIFIERS
    kind_of = np.full(IDENTIFIERS, -1, np.int16)
    number_of = np.zeros(IDENTIFIERS, np.int16)
    key_shift = np.zeros(IDENTIFIERS, np.uint64)
    key_mask = np.zeros(IDENTIFIERS, np.uint64)
    first_stream, streams = np.zeros(IDENTIFIERS, np.int64), 0
    for message in messages:
        kind, can_id = message.kind, message.can_id
        if kind.name not in kinds:
            kinds[kind.name] = _layout(len(kinds), kind)
        layout = kinds[kind.name]
        number = (can_id - kind.base) // kind.stride + 1 if kind.per else 0
        kind_of[can_id] = layout.number
        number_of[can_id] = number
        senders[can_id] = message.sender
        key_shift[can_id] = layout.key_shift
        key_mask[can_id] = layout.key_mask
        first_stream[can_id] = streams
        streams += layout.key_mask + 1
        can_id_of[kind.name, number] = can_id
    digest = hashlib.sha256(text.encode("ascii")).digest()
    return Codec(
        receivers=receivers,
        text=text,
        hash=int.from_bytes(digest[:4], "big"),
        kinds=kinds,
        layouts=tuple(kinds.values()),
        can_id_of=can_id_of,
        kind_of=kind_of,
        number_of=number_of,
        sender_of=tuple(senders),
        key_shift_of=key_shift,
        key_mask_of=key_mask,
        first_stream_of=first_stream,
        streams=streams,
    )


@cache
def codec(receivers: int = 4) -> Codec:
    """The codec of the contract with this many receivers; four is the checked-in file."""
    if not 1 <= receivers <= MAX_RECEIVERS:
        raise ValueError(f"{receivers} receivers; a contract has 1 to {MAX_RECEIVERS}")
    shipped = resources.files("gnss_hil.dbc.contract").joinpath("gnss.dbc")
    text = shipped.read_text("ascii") if receivers == 4 else dbc_text(receivers)
    return of_messages(messages(receivers), text, receivers)
