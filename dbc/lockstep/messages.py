"""Bench frames: what lockstep says on the bus, and the one rule by which a bench frame is believed.

Layouts as BENCH_SYNC, BENCH_DONE, BENCH_END of the DBC, protected like all frames. They belong to the bench,
not to the spacecraft, and bear no simulated time. Their counter is the epoch modulo 15, so that a repeated
frame is the same frame; receivers do not ask for its sequence, which session and epoch say better.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.allocation import BENCH_FIRST, BENCH_LAST
from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch
from gnss_hil.dbc.contract.messages import KIND_BY_NAME
from gnss_hil.dbc.contract.values import VALUES

SYNC_ID = KIND_BY_NAME["BENCH_SYNC"].base
DONE_ID = KIND_BY_NAME["BENCH_DONE"].base
END_ID = KIND_BY_NAME["BENCH_END"].base
END_REASON = {label: raw for raw, label in VALUES["EndReason"].items()}

NEAR = 1
"""A bench frame is believed for the epoch that is expected or one beside it."""

LEAD = 16
"""A time mark leads on by so many epochs at most. One that is farther ahead, goes back or is of another
session is believed when what follows bears it out: `Slave`."""

EPOCHS = 1 << 16
"""The epoch is carried modulo this."""

_KNOWN = (SYNC_ID, DONE_ID, END_ID)
_LAYOUT = struct.Struct("<BBHHH")


class Refusal(Enum):
    """Why a bench frame is not believed, for people."""

    UNKNOWN = "no bench frame of the contract"
    WRONG_LENGTH = "wrong length"
    CORRUPTED = "corrupted"
    OTHER_SESSION = "of another session"
    OTHER_EPOCH = "of another epoch"
    OUT_OF_TURN = "out of turn"


@dataclass(frozen=True, slots=True)
class Bench:
    """One bench frame; `count` is frames in the block, or END's reason; END's epoch is the one that will not
    come."""

    can_id: int
    session: int
    epoch: int
    count: int


def encode(can_id: int, session: int, epoch: int, count: int) -> FrameBatch:
    header = epoch % e2e.COUNTERS | epoch % 16 << 4
    text = _LAYOUT.pack(0, header, epoch % EPOCHS, session, count)
    payload = np.frombuffer(text, np.uint8)[None, :].copy()
    identifiers = np.array([can_id], np.uint32)
    payload[:, 0] = e2e.crc(identifiers, payload)
    return FrameBatch(np.zeros(1, np.int64), identifiers, np.array([WIDTH], np.uint8), payload)


def recounted(frame: FrameBatch, more: int) -> FrameBatch:
    """A SYNC or DONE whose count is by so many more (fewer), from 0 to the most that it can say."""
    can_id = int(frame.can_id[0])
    _, _, epoch, session, count = _LAYOUT.unpack(frame.data[0].tobytes())
    payload = frame.data.copy()
    payload[0] = np.frombuffer(
        _LAYOUT.pack(0, payload[0, 1], epoch, session, min(max(count + more, 0), 0xFFFF)), np.uint8
    )
    payload[:, 0] = e2e.crc(np.array([can_id], np.uint32), payload)
    return FrameBatch(frame.t_ns, frame.can_id, frame.length, payload)


def judge(frames: FrameBatch, row: int, session: int, expected: int) -> Bench | Refusal:
    """What a bench frame says, its epoch in full, or why it is not believed: one rule for all who hear it.

    It must be of eight bytes and intact, of the run's session, and of the expected epoch or one beside it.
    """
    can_id = int(frames.can_id[row])
    if can_id not in _KNOWN:
        return Refusal.UNKNOWN
    if frames.length[row] != WIDTH:
        return Refusal.WRONG_LENGTH
    payload = frames.data[row : row + 1]
    check, header, low, spoken, count = _LAYOUT.unpack(payload.tobytes())
    counter, nibble = header & 15, header >> 4
    intact = check == e2e.crc(frames.can_id[row], payload)[0]
    if not intact or counter >= e2e.COUNTERS or nibble != low % 16:
        return Refusal.CORRUPTED
    if spoken != session:
        return Refusal.OTHER_SESSION
    ahead = _ahead(low, expected)
    if abs(ahead) > NEAR or expected + ahead < 0:
        return Refusal.OTHER_EPOCH
    return Bench(can_id, spoken, expected + ahead, count)


def late_answer(frames: FrameBatch, row: int, refusal: Refusal, expected: int, session: int) -> Bench | None:
    """What a DONE says that was refused because it is of an epoch before the last; None for all others."""
    if frames.can_id[row] != DONE_ID or refusal is not Refusal.OTHER_EPOCH:
        return None
    _, _, low, spoken, count = _LAYOUT.unpack(frames.data[row].tobytes())
    ahead = _ahead(low, expected)
    known = spoken == session and ahead < 0 <= expected + ahead
    return Bench(DONE_ID, spoken, expected + ahead, count) if known else None


def _ahead(low: int, expected: int) -> int:
    """By how many epochs one, carried modulo EPOCHS, is ahead of the expected one."""
    return (low - expected + EPOCHS // 2) % EPOCHS - EPOCHS // 2


def session_in(frames: FrameBatch, row: int) -> int:
    """The session that a bench frame of eight bytes names, believed or not."""
    return _LAYOUT.unpack(frames.data[row].tobytes())[3]


def rows(frames: FrameBatch) -> list[int]:
    """Rows that hold bench frames."""
    return np.flatnonzero(is_bench(frames.can_id)).tolist()


def is_bench(can_id: NDArray[np.uint32]) -> NDArray[np.bool_]:
    return can_id - np.uint32(BENCH_FIRST) <= np.uint32(BENCH_LAST - BENCH_FIRST)  # below wraps to the top


def counted(block: FrameBatch) -> int:
    """Frames of a block that SYNC and DONE count: bench frames that faults have put into it are none."""
    return len(block) - int(is_bench(block.can_id).sum())


def explain(refused: Mapping[Refusal, int]) -> str:
    """Refused bench frames by reason, for people: "" if none was."""
    found = ", ".join(f"{count} {why.value}" for why, count in refused.items() if count)
    return f"{sum(refused.values())} bench frames refused: {found}" if found else ""


def session_of(seed: int) -> int:
    """Run identifier of a seed, so that the same run has the same frames: 16 bits, never 0."""
    return zlib.crc32(seed.to_bytes(8, "little")) % 0xFFFF + 1
