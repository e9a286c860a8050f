"""End-to-end protection: AUTOSAR E2E Profile 11, variant A.

CRC in byte 0, counter 0..14 in the low nibble of byte 1, 16-bit data id (= the identifier) entering
the CRC only (E2E_P11_DATAID_BOTH). The high nibble of byte 1 is payload by the profile; every message
of this contract carries the epoch modulo 16 there. Source: AUTOSAR PRS E2E Protocol, Profile 11; CRC-8
SAE J1850, polynomial 0x1D.

A protected stream is (identifier, key): the key is the channel where a message has one.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from dbc.codec import IDENTIFIERS, STREAMS, Codec
from dbc.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, SFF_MASK, FrameBatch

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


_TABLE = _crc_table()


def _position_tables() -> NDArray[np.uint8]:
    """(7, 256): what byte 1..7 contributes to the final CRC. The CRC is linear over GF(2), so the
    contributions of the bytes are looked up independently and XORed."""
    tables = [_TABLE]
    for _ in range(6):
        tables.insert(0, _TABLE[tables[0]])
    return np.array(tables)


_POSITION = _position_tables()
_ROW = np.arange(7)


def _identifier_crc() -> NDArray[np.uint8]:
    """(2048,) contribution of the data id (low byte first) to the CRC. The profile's calls of the CRC
    library cancel its start value and final XOR, so both are zero."""
    ids = np.arange(IDENTIFIERS)
    crc = _TABLE[_TABLE[ids & 0xFF] ^ (ids >> 8)]
    for _ in range(7):
        crc = _TABLE[crc]
    return crc


_IDENTIFIER = _identifier_crc()


def crc(can_id: NDArray, data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(n,) Profile 11A CRC of payloads (n, 8) under data ids (n,)."""
    return np.bitwise_xor.reduce(_POSITION[_ROW, data[:, 1:]], axis=1) ^ _IDENTIFIER[can_id]


def fresh_counters() -> NDArray[np.int8]:
    """Sender or receiver state: (STREAMS,) last counter of each protected stream, -1 before the first."""
    return np.full(STREAMS, -1, np.int8)


def _ranks(stream: NDArray[np.int64]) -> tuple[NDArray, NDArray, NDArray]:
    """Stable order by stream; in that order, True where a stream begins, and the rank within it."""
    order = np.argsort(stream, kind="stable")
    ordered = stream[order]
    begins = np.ones(len(ordered), bool)
    begins[1:] = ordered[1:] != ordered[:-1]
    positions = np.arange(len(ordered))
    return order, begins, positions - np.maximum.accumulate(np.where(begins, positions, 0))


def protect(
    codec: Codec, frames: FrameBatch, counters: NDArray[np.int8], epoch: int
) -> tuple[FrameBatch, NDArray[np.int8]]:
    """Frames with CRC, counter and epoch nibble filled in, and the sender's next counters.

    Unprotected kinds pass unchanged. Neither argument is modified.
    """
    if not len(frames):
        return frames, counters
    data = frames.data.copy()
    guarded = codec.protected_of[frames.can_id]
    rows = slice(None) if guarded.all() else np.flatnonzero(guarded)
    stream = codec.key_of(frames.can_id[rows], data[rows])
    order, _, rank = _ranks(stream)
    counter = np.empty(len(stream), np.int64)
    counter[order] = (counters[stream[order]] + 1 + rank) % COUNTERS
    counters = counters.copy()
    counters[stream[order]] = counter[order]
    data[rows, 1] = counter | (epoch % 16) << 4
    data[rows, 0] = crc(frames.can_id[rows], data[rows])
    return FrameBatch(frames.t_ns, frames.can_id, frames.length, data), counters


@dataclass(frozen=True, slots=True)
class Screened:
    """A batch after the checks.

    frames    the accepted ones, in order
    verdict   (n,) uint8 Verdict of every received frame
    counters  receiver's next state
    lost      frames missing before the accepted ones, by the counters
    """

    frames: FrameBatch
    verdict: NDArray[np.uint8]
    counters: NDArray[np.int8]
    lost: int


def _form_verdict(codec: Codec, frames: FrameBatch) -> NDArray[np.uint8]:
    """Checks that need no payload; later rows of the table win."""
    can_id = frames.can_id
    verdict = np.zeros(len(frames), np.uint8)
    if (can_id <= SFF_MASK).all() and (frames.length == 8).all():
        verdict[codec.kind_of[can_id] < 0] = Verdict.UNKNOWN_ID
        return verdict
    verdict[codec.kind_of[can_id & SFF_MASK] < 0] = Verdict.UNKNOWN_ID
    verdict[frames.length != 8] = Verdict.WRONG_LENGTH
    verdict[can_id & RTR_FLAG != 0] = Verdict.REMOTE
    verdict[can_id & EFF_FLAG != 0] = Verdict.EXTENDED
    verdict[can_id & ERR_FLAG != 0] = Verdict.ERROR_FRAME
    return verdict


def screen(codec: Codec, frames: FrameBatch, counters: NDArray[np.int8]) -> Screened:
    """Check form, CRC and counters of received frames. Never raises on what a bus may carry."""
    if not len(frames):
        return Screened(frames, np.zeros(0, np.uint8), counters, 0)
    verdict = _form_verdict(codec, frames)
    can_id = frames.can_id & SFF_MASK
    rows = np.flatnonzero((verdict == 0) & codec.protected_of[can_id])
    data = frames.data[rows]
    intact = data[:, 0] == crc(can_id[rows], data)
    intact &= (data[:, 1] & 0x0F) < COUNTERS
    verdict[rows[~intact]] = Verdict.CORRUPTED
    rows, data = rows[intact], data[intact]

    stream = codec.key_of(can_id[rows], data)
    order, begins, _ = _ranks(stream)
    counter = (data[order, 1] & 0x0F).astype(np.int16)
    last = counters[stream[order]].astype(np.int16)
    last[1:] = np.where(begins[1:], last[1:], counter[:-1])
    delta = np.where(last < 0, 1, (counter - last) % COUNTERS)
    verdict[rows[order]] = np.select(
        [delta == 1, delta == 0, delta <= MAX_DELTA],
        [Verdict.OK, Verdict.REPEATED, Verdict.LOST],
        Verdict.WRONG_SEQUENCE,
    )
    counters = counters.copy()
    counters[stream[order]] = counter
    lost = int((delta[(delta > 1) & (delta <= MAX_DELTA)] - 1).sum())
    return Screened(frames[verdict <= Verdict.LOST], verdict, counters, lost)
