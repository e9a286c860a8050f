"""Reading and writing many frames of many kinds at once.

The codec works on the frames of one kind. An epoch brings two dozen kinds of a few frames each, so reading or
writing it kind by kind costs hundreds of array operations; here it costs one pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dbc.codec import IDENTIFIERS, Codec, Layout

_HEADER = ("e2e_crc", "e2e_counter", "epoch_mod16")


def payload(layout: Layout) -> list[int]:
    """Rows of a layout's signals behind the protection header."""
    return [i for i, name in enumerate(layout.signals) if name not in _HEADER]


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Payload signals by identifier: (2048, w) shift, mask, sign bit and factor, w the most a kind has.

    Columns a kind does not have read as zero. All scaled signals of this contract have offset zero.
    """

    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    sign_bit: NDArray[np.int64]
    factor: NDArray[np.float64]

    def read(self, can_id: NDArray, words: NDArray[np.uint64]) -> NDArray[np.float64]:
        """Physical values (n, w) of frames (n,); exact, no signal has more than 53 bits."""
        raw = words[:, None] >> self.shift.take(can_id, axis=0)
        raw &= self.mask.take(can_id, axis=0)
        raw = raw.view(np.int64)
        sign_bit = self.sign_bit.take(can_id, axis=0)
        raw ^= sign_bit
        raw -= sign_bit
        return raw * self.factor.take(can_id, axis=0)


def reader(codec: Codec, kinds: Sequence[str]) -> Reader:
    """For frames of these kinds."""
    width = max(len(payload(codec.kinds[kind])) for kind in kinds)
    shape = IDENTIFIERS, width
    tables = [np.zeros(shape, t) for t in (np.uint64, np.uint64, np.int64, np.float64)]
    for (kind, _), can_id in codec.can_id_of.items():
        if kind not in kinds:
            continue
        layout = codec.kinds[kind]
        rows = payload(layout)
        assert not layout.offset[rows].any()
        for table, column in zip(
            tables, (layout.shift, layout.mask, layout.sign_bit, layout.factor), strict=True
        ):
            table[can_id, : len(rows)] = column[rows]
    return Reader(*tables)


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """k frames to write together, s payload signals one after another.

    can_id (k,), length (k,)   of the frames
    starts (k,)                first signal of each frame
    shift, mask, factor, raw_min, raw_max   (s,)
    """

    can_id: NDArray[np.uint32]
    length: NDArray[np.uint8]
    starts: NDArray[np.intp]
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    factor: NDArray[np.float64]
    raw_min: NDArray[np.float64]
    raw_max: NDArray[np.float64]

    def write(self, values: Sequence[float]) -> NDArray[np.uint8]:
        """Payloads (k, 8) from values (s,), rounded half to even; what does not fit saturates."""
        raw = np.rint(np.array(values, float) / self.factor)
        raw = np.minimum(np.maximum(raw, self.raw_min), self.raw_max)
        bits = (raw.astype(np.int64).view(np.uint64) & self.mask) << self.shift
        return (
            np.bitwise_or.reduceat(bits, self.starts).astype("<u8", copy=False).view(np.uint8).reshape(-1, 8)
        )


def sheet(codec: Codec, frames: Sequence[tuple[str, int]]) -> Sheet:
    """The sheet of these frames, each (kind, number) as in `codec.can_id_of`; a kind may repeat."""
    layouts = [codec.kinds[kind] for kind, _ in frames]
    rows = [payload(layout) for layout in layouts]
    sizes = [len(r) for r in rows]

    def column(name: str) -> NDArray:
        return np.concatenate([getattr(layout, name)[r] for layout, r in zip(layouts, rows, strict=True)])

    assert not column("offset").any()
    return Sheet(
        np.array([codec.can_id_of[frame] for frame in frames], np.uint32),
        np.full(len(frames), 8, np.uint8),
        np.cumsum([0, *sizes[:-1]]),
        *(column(name) for name in ("shift", "mask", "factor", "raw_min", "raw_max")),
    )
