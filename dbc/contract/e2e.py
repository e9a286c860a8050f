"""End-to-end protection: AUTOSAR E2E Profile 11, variant A.

CRC in byte 0, counter 0..14 in the low nibble of byte 1, 16-bit data id (= the identifier) entering
the CRC only (E2E_P11_DATAID_BOTH). The high nibble of byte 1 is payload by the profile; every message
of this contract carries the epoch modulo 16 there. Source: AUTOSAR PRS E2E Protocol, Profile 11; CRC-8
SAE J1850, polynomial 0x1D.

A protected stream is (identifier, key): the key is the channel where a message has one. `Codec` numbers them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec
from gnss_hil.dbc.contract.frames import (
    EFF_FLAG,
    EFF_MASK,
    ERR_FLAG,
    RTR_FLAG,
    SFF_MASK,
    WIDTH,
    FrameBatch,
)

COUNTERS = 15
MAX_DELTA = 3
"""A stream may lose MAX_DELTA - 1 frames in a row and still be accepted (as LOST)."""

_POLYNOMIAL = 0x1D


class Verdict(IntEnum):
    """What became of a received frame. OK and LOST are accepted, all others rejected before decoding."""

    OK = 0
    LOST = 1
    REPEATED = 2
    WRONG_SEQUENCE = 3
    CORRUPTED = 4
    UNKNOWN_ID = 5
    WRONG_LENGTH = 6
    REMOTE = 7
    EXTENDED = 8
    ERROR_FRAME = 9
    MIXED_EPOCH = 10


CONSEQUENCE: dict[Verdict, str] = {
    Verdict.LOST: "frame used; at least one before it is missing",
    Verdict.REPEATED: "frame ignored, the first one stands",
    Verdict.WRONG_SEQUENCE: "frame ignored, the stream restarts from its counter",
    Verdict.CORRUPTED: "frame ignored, its channel is out of this epoch",
    Verdict.UNKNOWN_ID: "frame ignored, not in the contract",
    Verdict.WRONG_LENGTH: "frame ignored, not in the contract",
    Verdict.REMOTE: "frame ignored, the contract has no remote frames",
    Verdict.EXTENDED: "frame ignored, the contract has 11-bit identifiers only",
    Verdict.ERROR_FRAME: "frame ignored, the controller reports a bus error",
    Verdict.MIXED_EPOCH: "frame ignored, it belongs to another epoch",
}


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
    return _payload_crc(data) ^ _IDENTIFIER[can_id]


def _payload_crc(data: NDArray[np.uint8]) -> NDArray[np.uint8]:
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


def _runs(stream: NDArray[np.int64]) -> Runs | None:
    """None where every stream occurs once: the ordinary case. The same streams come epoch after epoch."""
    return _runs_of(stream.tobytes())


@lru_cache(maxsize=32)
def _runs_of(streams: bytes) -> Runs | None:
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
    runs = _runs(stream)
    counter = counters.take(stream).astype(np.int64) + (1 if runs is None else 1 + runs.rank)
    counter %= COUNTERS
    counters = counters.copy()
    counters[stream] = counter
    data = frames.data.copy()
    data[:, 1] = counter | (epoch % 16) << 4
    data[:, 0] = _payload_crc(data) ^ ids.crc
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


@dataclass(frozen=True, slots=True)
class Screened:
    """A batch after the checks.

    frames    the accepted ones, in order
    verdict   (n,) uint8 Verdict of every received frame
    counters  receiver's next state
    lost      frames missing before the accepted ones, by the counters
    streams   (n,) protected stream of each received frame; None where not all were known and accepted
    """

    frames: FrameBatch
    verdict: NDArray[np.uint8]
    counters: NDArray[np.int8]
    lost: int
    streams: NDArray[np.int64] | None = None


_PASS, _LOST = int(Verdict.OK), int(Verdict.LOST)

# Verdict by counter advance: 0, 1, 2 .. MAX_DELTA, more.
_BY_ADVANCE = np.array(
    [Verdict.REPEATED, Verdict.OK, *[Verdict.LOST] * (MAX_DELTA - 1)]
    + [Verdict.WRONG_SEQUENCE] * (COUNTERS - 1 - MAX_DELTA),
    np.uint8,
)


def _advance_table() -> NDArray[np.intp]:
    """(256,) how far a counter has advanced, by 16 times the one before plus itself; after -1, which stands
    for none and indexes the last 16, every counter is the next."""
    before, counter = np.divmod(np.arange(256), 16)
    return np.where(before == COUNTERS, 1, (counter - before) % COUNTERS)


_ADVANCE = _advance_table()
_VERDICT = _BY_ADVANCE[_ADVANCE]


def _form_verdict(codec: Codec, frames: FrameBatch) -> NDArray[np.uint8]:
    """Checks that need no payload; later rows of the table win."""
    can_id = frames.can_id
    verdict = np.zeros(len(frames), np.uint8)
    for verdict_if, failed in (
        (Verdict.UNKNOWN_ID, (codec.kind_of[can_id & SFF_MASK] < 0) | (can_id & EFF_MASK > SFF_MASK)),
        (Verdict.WRONG_LENGTH, frames.length != 8),
        (Verdict.REMOTE, can_id & RTR_FLAG != 0),
        (Verdict.EXTENDED, can_id & EFF_FLAG != 0),
        (Verdict.ERROR_FRAME, can_id & ERR_FLAG != 0),
    ):
        verdict[failed] = int(verdict_if)
    return verdict


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """Received frames (n,) by what each says alone, before counters are looked at.

    verdict   (n,) uint8: OK where form and CRC are right
    sound     it is OK everywhere
    rows      (k,) frames of the contract with a right form; None: all
    streams   (k,) protected stream of each of these
    """

    verdict: NDArray[np.uint8]
    sound: bool
    rows: NDArray[np.intp] | None
    streams: NDArray[np.int64]

    def refusing(self, which: NDArray[np.bool_], verdict: int) -> Checked:
        """With this verdict on some of the frames that are sound so far."""
        refused = which & (self.verdict == _PASS)
        if not refused.any():
            return self
        return Checked(np.where(refused, np.uint8(verdict), self.verdict), False, self.rows, self.streams)


def screen(
    codec: Codec, frames: FrameBatch, counters: NDArray[np.int8], ids: Identifiers | None = None
) -> Screened:
    """Check form, CRC and counters of received frames. Never raises on what a bus may carry.

    ids   `identifiers` of the frames, where the caller has it
    """
    return sequenced(frames, checked(codec, frames, ids), counters)


def checked(codec: Codec, frames: FrameBatch, ids: Identifiers | None = None) -> Checked:
    """The first half of `screen`: form and CRC."""
    if not len(frames):
        return Checked(np.zeros(0, np.uint8), True, None, np.zeros(0, np.int64))
    ids = identifiers(codec, frames.can_id) if ids is None else ids
    if ids is not None and (frames.length == WIDTH).all():
        verdict, sound = _integrity(ids, frames.data)
        return Checked(verdict, sound, None, ids.streams(frames.words))
    verdict = _form_verdict(codec, frames)
    rows = np.flatnonzero(verdict == _PASS)
    ids = identifiers(codec, frames.can_id[rows]) if len(rows) else None
    if ids is None:
        return Checked(verdict, False, rows, np.zeros(0, np.int64))
    some = frames[rows]
    verdict[rows] = _integrity(ids, some.data)[0]
    return Checked(verdict, False, rows, ids.streams(some.words))


def sequenced(frames: FrameBatch, checked: Checked, counters: NDArray[np.int8]) -> Screened:
    """The second half of `screen`: counters, of the frames whose verdict is OK. Others do not move them."""
    if not len(frames):
        return Screened(frames, checked.verdict, counters, 0)
    if checked.sound:
        verdict, counters, lost = _sequence_verdict(checked.streams, frames.data, counters)
    else:
        verdict, lost = checked.verdict.copy(), 0
        formed = np.arange(len(frames)) if checked.rows is None else checked.rows
        counted = verdict[formed] == _PASS
        if counted.any():
            rows = formed[counted]
            verdict[rows], counters, lost = _sequence_verdict(
                checked.streams[counted], frames.data[rows], counters
            )
    accepted = verdict <= _LOST
    if accepted.all():
        return Screened(frames, verdict, counters, lost, checked.streams)
    return Screened(frames[accepted], verdict, counters, lost)


def _integrity(ids: Identifiers, data: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], bool]:
    """(n,) OK or CORRUPTED: well-formed frames by CRC and by counters that there are not; whether all are
    OK."""
    counter = data[:, 1] & 0x0F
    intact = (data[:, 0] == _payload_crc(data) ^ ids.crc) & (counter < COUNTERS)
    verdict = np.zeros(len(data), np.uint8)
    sound = bool(intact.all())
    if not sound:
        verdict[~intact] = int(Verdict.CORRUPTED)
    return verdict, sound


def _sequence_verdict(
    stream: NDArray[np.int64], data: NDArray[np.uint8], counters: NDArray[np.int8]
) -> tuple[NDArray[np.uint8], NDArray[np.int8], int]:
    """Verdict of intact frames by counter, next counters, and frames missing between."""
    counter = data[:, 1] & 0x0F
    last = counters.take(stream).astype(np.intp)
    runs = _runs(stream)
    if runs is not None:
        before = np.empty_like(last)
        before[runs.order[1:]] = counter[runs.order[:-1]]
        last = np.where(runs.rank > 0, before, last)
    steps = last * 16 + counter
    verdict = _VERDICT.take(steps)
    counters = counters.copy()
    counters[stream] = counter
    lost = 0
    if verdict.any():
        lost = int((_ADVANCE[steps[verdict == _LOST]] - 1).sum())
    return verdict, counters, lost
