"""Bench frames: what lockstep says on the bus. Layouts as BENCH_SYNC, BENCH_DONE, BENCH_END of the DBC.

They bear no protection and no simulated time: they belong to the bench, not to the spacecraft.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import BENCH_FIRST, BENCH_LAST, KIND_BY_NAME, VALUES

SYNC_ID = KIND_BY_NAME["BENCH_SYNC"].base
DONE_ID = KIND_BY_NAME["BENCH_DONE"].base
END_ID = KIND_BY_NAME["BENCH_END"].base
END_REASON = {label: raw for raw, label in VALUES["EndReason"].items()}

_LAYOUT = struct.Struct("<IHH")


@dataclass(frozen=True, slots=True)
class Bench:
    """One bench frame; `count` is frames in the block, or END's reason."""

    can_id: int
    session: int
    epoch: int
    count: int


def encode(can_id: int, session: int, epoch: int, count: int) -> FrameBatch:
    payload = np.frombuffer(_LAYOUT.pack(epoch, session, count), np.uint8)
    return FrameBatch(
        np.zeros(1, np.int64), np.array([can_id], np.uint32), np.array([8], np.uint8), payload[None, :]
    )


def decode(frames: FrameBatch, row: int) -> Bench:
    epoch, session, count = _LAYOUT.unpack(frames.data[row].tobytes())
    return Bench(int(frames.can_id[row]), session, epoch, count)


def rows(frames: FrameBatch) -> list[int]:
    """Rows that hold bench frames."""
    return np.flatnonzero(_is_bench(frames.can_id)).tolist()


def _is_bench(can_id: NDArray[np.uint32]) -> NDArray[np.bool_]:
    return can_id - np.uint32(BENCH_FIRST) <= np.uint32(BENCH_LAST - BENCH_FIRST)  # below wraps to the top


def session_of(seed: int) -> int:
    """Run identifier of a seed, so that the same run has the same frames: 16 bits, never 0."""
    return zlib.crc32(seed.to_bytes(8, "little")) % 0xFFFF + 1
