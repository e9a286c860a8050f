"""Batches of CAN frames: SocketCAN semantics as a structure of arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Flag bits and masks of a SocketCAN identifier, <linux/can.h>.
EFF_FLAG = 0x8000_0000
RTR_FLAG = 0x4000_0000
ERR_FLAG = 0x2000_0000
SFF_MASK = 0x7FF
EFF_MASK = 0x1FFF_FFFF

WIDTH = 8
"""Payload bytes of a classical CAN frame."""

CAN_FRAME = np.dtype(
    [("can_id", "<u4"), ("length", "u1"), ("pad", "u1", 3), ("data", "u1", WIDTH)], align=False
)
"""`struct can_frame` of <linux/can.h> on a little-endian machine, 16 bytes: the wire of the embedded bus."""


@dataclass(frozen=True, slots=True)
class FrameBatch:
    """Frames in the order they were sent.

    t_ns     (n,) int64   simulated GPS time [ns since 1980-01-06]; 0 where the link cannot know it
    can_id   (n,) uint32  identifier with EFF/RTR/ERR flag bits
    length   (n,) uint8   payload bytes in use
    data     (n, width) uint8, C-contiguous; bytes beyond `length` are zero
    """

    t_ns: NDArray[np.int64]
    can_id: NDArray[np.uint32]
    length: NDArray[np.uint8]
    data: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.can_id)

    @property
    def words(self) -> NDArray[np.uint64]:
        """(n,) payloads, each as one little-endian word."""
        return np.ascontiguousarray(self.data).view("<u8")[:, 0]

    def __getitem__(self, rows) -> FrameBatch:
        """Rows by slice, mask or index array; always a batch."""
        if isinstance(rows, (int, np.integer)):
            rows = slice(rows, rows + 1 or None)
        return FrameBatch(self.t_ns[rows], self.can_id[rows], self.length[rows], self.data[rows])

    def __eq__(self, other) -> bool:
        return isinstance(other, FrameBatch) and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in self.__slots__
        )

    __hash__ = None  # pyright: ignore[reportAssignmentType]: equal by content, which may change


EMPTY = FrameBatch(
    np.zeros(0, np.int64), np.zeros(0, np.uint32), np.zeros(0, np.uint8), np.zeros((0, WIDTH), np.uint8)
)


def batch(can_id, data, *, t_ns=0, length=None) -> FrameBatch:
    """A batch from identifiers (n,) and payloads (n, 8) or bytes; scalars broadcast over the rows."""
    can_id = np.atleast_1d(np.asarray(can_id, np.uint32))
    if isinstance(data, (bytes, bytearray)):
        length = len(data) if length is None else length
        data = np.frombuffer(bytes(data).ljust(WIDTH, b"\0"), np.uint8)[None, :]
    data = np.ascontiguousarray(np.broadcast_to(np.asarray(data, np.uint8), (len(can_id), WIDTH)))
    full = WIDTH if length is None else length
    return FrameBatch(
        np.broadcast_to(np.asarray(t_ns, np.int64), can_id.shape).copy(),
        can_id,
        np.broadcast_to(np.asarray(full, np.uint8), can_id.shape).copy(),
        data,
    )


def concat(batches: Iterable[FrameBatch]) -> FrameBatch:
    """The batches one after another."""
    batches = [b for b in batches if len(b)]
    if not batches:
        return EMPTY
    if len(batches) == 1:
        return batches[0]
    return FrameBatch(
        np.concatenate([b.t_ns for b in batches]),
        np.concatenate([b.can_id for b in batches]),
        np.concatenate([b.length for b in batches]),
        np.concatenate([b.data for b in batches]),
    )


def to_wire(frames: FrameBatch) -> bytes:
    """Concatenated 16-byte `struct can_frame`."""
    rows = np.zeros(len(frames), CAN_FRAME)
    rows["can_id"] = frames.can_id
    rows["length"] = frames.length
    rows["data"] = frames.data
    return rows.tobytes()


def from_wire(wire: bytes, t_ns: int = 0) -> FrameBatch:
    """Frames from concatenated `struct can_frame`; the length must be a multiple of 16."""
    rows = np.frombuffer(wire, CAN_FRAME)
    words = np.frombuffer(wire, "<u8")[1::2].copy()  # payloads: words move faster than bytes
    return FrameBatch(
        np.full(len(rows), t_ns, np.int64),
        rows["can_id"].astype(np.uint32),
        rows["length"].copy(),
        words.view(np.uint8).reshape(-1, WIDTH),
    )
