"""End-to-end protection: AUTOSAR E2E Profile 11, variant A, and what a sender fills in.

CRC in byte 0, counter 0..14 in the low nibble of byte 1, 16-bit data id (= the identifier) entering
the CRC only (E2E_P11_DATAID_BOTH). The high nibble of byte 1 is payload by the profile; every message
of this contract carries the epoch modulo 16 there. Source: AUTOSAR PRS E2E Protocol, Profile 11; CRC-8
SAE J1850, polynomial 0x1D. What a receiver makes of it: `screening`.

A protected stream is (identifier, key): the key is the channel where a message has one. `Codec` numbers them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import (
    SFF_MASK,
    FrameBatch,
)

COUNTERS = 15

_POLYNOMIAL = 0x1D


def _crc_table() -> NDArray[np.uint8]:
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = np.where(table & 0x80, (table << 1) ^ _POLYNOMIAL, table << 1) & 0xFF
    return table.astype(np.uint8)


TABLE = _crc_table()
"""(256,) uint8 CRC of each byte: CRC after = TABLE[CRC before XOR byte]."""


def _pair_tables() -> NDArray[np.uint8]:
    """(4 * 65536,) what the little-endian byte pairs 0..3 of a payload contribute to the final CRC.

    The CRC is linear over GF(2): contributions are looked up independently and XORed. Byte 0 holds the
    CRC itself and contributes nothing.
    """
    byte = [TABLE]
    for _ in range(6):
        byte.insert(0, TABLE[byte[0]])
    byte.insert(0, np.zeros(256, np.uint8))
    pairs = [byte[2 * p][None, :] ^ byte[2 * p + 1][:, None] for p in range(4)]
    return np.concatenate([pair.ravel() for pair in pairs])


_PAIR = _pair_tables()
_PAIR_BASE = np.arange(4, dtype=np.int64)[:, None] << 16


def _identifier_crc() -> NDArray[np.uint8]:
    """(2048,) contribution of the data id (low byte first) to the CRC. The profile's calls of the CRC
    library cancel its start value and final XOR, so both are zero."""
    ids = np.arange(IDENTIFIERS)
    crc = TABLE[TABLE[ids & 0xFF] ^ (ids >> 8)]
    for _ in range(7):
        crc = TABLE[crc]
    return crc


_IDENTIFIER = _identifier_crc()


def crc(can_id: NDArray, data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(n,) Profile 11A CRC of payloads (n, 8) under data ids (n,)."""
    return payload_crc(data) ^ _IDENTIFIER[can_id]


def payload_crc(data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(n,) what payloads (n, 8) contribute to the CRC."""
    pairs = np.ascontiguousarray(data).view("<u2").T
    return np.bitwise_xor.reduce(_PAIR.take(np.add(pairs, _PAIR_BASE, order="C")))


def fresh_counters(codec: Codec) -> NDArray[np.int8]:
    """Sender or receiver state: (streams,) last counter of each protected stream, -1 before the first."""
    return np.full(codec.streams, -1, np.int8)


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """Of frames of which some share a stream, (n,): stable order by stream, and how many frames of its stream
    come before each."""

    order: NDArray[np.intp]
    rank: NDArray[np.int64]


def runs_of(stream: NDArray[np.int64]) -> Runs | None:
    """None where every stream occurs once: the ordinary case. The same streams come epoch after epoch."""
    return _runs_of_bytes(stream.tobytes())


@lru_cache(maxsize=32)
def _runs_of_bytes(streams: bytes) -> Runs | None:
    stream = np.frombuffer(streams, np.int64)
    if len(set(stream.tolist())) == len(stream):
        return None
    order = np.argsort(stream, kind="stable")
    ordered = stream[order]
    positions = np.arange(len(ordered))
    begins = np.ones(len(ordered), bool)
    begins[1:] = ordered[1:] != ordered[:-1]
    rank = np.empty_like(stream)
    rank[order] = positions - np.maximum.accumulate(np.where(begins, positions, 0))
    return Runs(order, rank)


def protect(
    codec: Codec, frames: FrameBatch, counters: NDArray[np.int8], epoch: int
) -> tuple[FrameBatch, NDArray[np.int8]]:
    """Frames with CRC, counter and epoch nibble filled in, and the sender's next counters.

    What is not in the contract passes unchanged. Neither argument is modified.
    """
    if not len(frames):
        return frames, counters
    ids = identifiers(codec, frames.can_id)
    if ids is not None:
        return _sealed(ids, frames, counters, epoch)
    rows = np.flatnonzero(codec.kind_of[frames.can_id] >= 0)
    sealed, counters = protect(codec, frames[rows], counters, epoch)
    data = frames.data.copy()
    data[rows] = sealed.data
    return FrameBatch(frames.t_ns, frames.can_id, frames.length, data), counters


def _sealed(
    ids: Identifiers, frames: FrameBatch, counters: NDArray[np.int8], epoch: int
) -> tuple[FrameBatch, NDArray[np.int8]]:
    stream = ids.streams(frames.words)
    runs = runs_of(stream)
    counter = counters.take(stream).astype(np.int64) + (1 if runs is None else 1 + runs.rank)
    counter %= COUNTERS
    counters = counters.copy()
    counters[stream] = counter
    data = frames.data.copy()
    data[:, 1] = counter | (epoch % 16) << 4
    data[:, 0] = payload_crc(data) ^ ids.crc
    return FrameBatch(frames.t_ns, frames.can_id, frames.length, data), counters


def protect_words(
    can_id: NDArray,
    words: NDArray[np.uint64],
    stream: NDArray,
    rank: NDArray | None,
    counters: NDArray[np.int8],
    epoch: int,
) -> tuple[NDArray[np.uint8], NDArray[np.int8]]:
    """As `protect`, where streams are known beforehand: payloads (n, 8) and the sender's next counters.

    words    (n,) little-endian payloads with blank headers
    stream   (n,) of each;  rank (n,) how many frames of its stream come before it, None: each stream is once
    """
    counter = counters.take(stream).astype(np.int64) + (1 if rank is None else 1 + rank)
    counter %= COUNTERS
    counters = counters.copy()
    counters[stream] = counter
    header = (counter.view(np.uint64) | np.uint64(epoch % 16 << 4)) << np.uint64(8)
    data = (words | header).astype("<u8", copy=False).view(np.uint8).reshape(-1, 8)
    data[:, 0] = crc(can_id, data)
    return data, counters


@dataclass(frozen=True, slots=True, eq=False)
class Identifiers:
    """What the identifiers (n,) of the contract's frames decide about their protection, whatever they carry.

    can_id            themselves
    crc               contribution to the CRC
    first_stream      stream of key 0
    shift, key_mask   where a payload, as a little-endian word, has its key
    """

    can_id: NDArray[np.uint32]
    crc: NDArray[np.uint8]
    first_stream: NDArray[np.int64]
    shift: NDArray[np.uint64]
    key_mask: NDArray[np.uint64]

    def streams(self, words: NDArray[np.uint64]) -> NDArray[np.int64]:
        """(n,) protected stream of each frame, as `Codec.key_of`."""
        key = words >> self.shift
        key &= self.key_mask
        return key.view(np.int64) + self.first_stream


def identifiers(codec: Codec, can_id: NDArray[np.uint32]) -> Identifiers | None:
    """Of the identifiers of received frames (n,), n > 0; None if not all are of the contract. The same
    identifiers come epoch after epoch."""
    return _identifiers(codec, can_id.tobytes())


@lru_cache(maxsize=64)
def _identifiers(codec: Codec, identifiers: bytes) -> Identifiers | None:
    can_id = np.frombuffer(identifiers, np.uint32)
    if can_id.max() > SFF_MASK or (codec.kind_of[can_id] < 0).any():
        return None
    return Identifiers(
        can_id,
        _IDENTIFIER[can_id],
        codec.first_stream_of[can_id],
        codec.key_shift_of[can_id],
        codec.key_mask_of[can_id],
    )
