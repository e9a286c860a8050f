"""What a receiver accepts: form, CRC and counter of each frame, by AUTOSAR E2E Profile 11 (`e2e`)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.e2e import COUNTERS, Identifiers, identifiers, payload_crc, runs_of
from gnss_hil.dbc.contract.frames import (
    EFF_FLAG,
    EFF_MASK,
    ERR_FLAG,
    RTR_FLAG,
    SFF_MASK,
    WIDTH,
    FrameBatch,
)

MAX_DELTA = 3
"""A stream may lose MAX_DELTA - 1 frames in a row and still be accepted (as LOST)."""


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
    intact = (data[:, 0] == payload_crc(data) ^ ids.crc) & (counter < COUNTERS)
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
    runs = runs_of(stream)
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
