"""Objects of a BLF file: where they lie in a stretch of bytes, and the frames among them, all at once.

    0  "LOBJ"   4  header's size, u16   6  header's version, u16   8  object's size   12  type
    16 flags (1: time in 10 us, 2: in 1 ns)   24  time since the start of the measurement, u64

A gap of up to three bytes follows an object whose size is no multiple of four; how long it is differs from
program to program, so the next signature is looked for.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EFF_MASK, ERR_FLAG, RTR_FLAG, WIDTH, FrameBatch
from gnss_hil.tools.recording.formats.piece import CUT, FD, LogError

SIGNATURE = b"LOBJ"
CONTAINER = 10
BASE_BYTES = 16
"""Size, at least, of an object, and of a container's own header."""
MOST_GAP = 7
FRAME_BYTES = 1 << 16
"""No object that is a frame is longer."""

_WORD = int.from_bytes(SIGNATURE, "little")
_HEADER_BYTES = {1: 32, 2: 40}
_EXTENDED_AND_ID = 0x8000_0000 | EFF_MASK
_TEN_US = 1
_MOST_NS = 10**18

_MESSAGE, _ERROR, _ERROR_EXT, _MESSAGE2 = 1, 2, 73, 86
_FD_MESSAGE, _FD_MESSAGE_64, _FD_ERROR_64 = 100, 101, 104
FRAMES = {_MESSAGE: 16, _ERROR: 4, _ERROR_EXT: 32, _MESSAGE2: 16, _FD_MESSAGE: 20, _FD_MESSAGE_64: 40,
          _FD_ERROR_64: 16}  # fmt: skip
"""Types that are frames of CAN, and the bytes that each needs at least behind its header."""

OTHERS = {
    3: "overload frames", 4: "statistics", 5: "triggers", 31: "driver errors", 65: "texts",
    72: "system variables", 74: "driver errors", 90: "overruns", 92: "comments", 96: "markers",
    **{n: "environment variables" for n in (6, 7, 8, 9)},
    **{n: "events of LIN" for n in (*range(11, 22), *range(54, 62))},
    **{n: "events of FlexRay" for n in (29, 30, 40, 41, 42, *range(45, 51), 66, 67)},
    **{n: "events of Ethernet" for n in (71, 102, 113, 114, *range(116, 122))},
    **{n: "events of MOST" for n in (*range(22, 29), *range(32, 40))},
}  # fmt: skip
"""Types that are none, as far as they are known."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Frames of a stretch of bytes, in its order.

    ns       (n,) since the start of the measurement
    channel  (n,) from 0
    """

    ns: NDArray[np.int64]
    channel: NDArray[np.int64]
    frames: FrameBatch
    sent: NDArray[np.bool_]


def chain(data: bytes, origin: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(n,) places and sizes of the objects that begin in data, one behind the other.

    The last one may go on behind the data's end. LogError where an object is followed by something else.
    """
    start = data.find(SIGNATURE, 0, MOST_GAP + len(SIGNATURE))
    if start < 0:
        if len(data) >= MOST_GAP + len(SIGNATURE):
            raise LogError(f"{origin}: no object where one has to begin, but {data[:4].hex(' ')}")
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    words = np.frombuffer(data, "<u4", (len(data) - start) // 4, start)
    place = np.flatnonzero(words == _WORD) * 4 + start
    found = _linked(data, place, origin)
    if found is None:  # sizes that are no multiple of four, or payloads that hold the signature
        found = _linked(
            data, np.array([m.start() for m in re.finditer(SIGNATURE, data)]), origin, strict=True
        )
    assert found is not None
    return found


def _linked(
    data: bytes, place: NDArray[np.int64], origin: str, strict: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """The objects among the places of signatures (k,), the first of which is one.

    None if an object is followed by no such place, unless `strict`.
    """
    place = place[place <= len(data) - BASE_BYTES]
    raw = np.frombuffer(data, np.uint8)
    size = _u4(raw, place + 8)
    end = place + size
    gap = place[1:] - end[:-1]
    if (size >= BASE_BYTES).all() and ((gap >= 0) & (gap <= MOST_GAP)).all():
        rows = np.arange(len(place))
    else:
        rows = _follow(place, size, end, len(data), origin, strict)
        if rows is None:
            return None
    reached = int(end[rows[-1]]) if len(rows) else 0
    if len(rows) and len(data) - reached >= MOST_GAP + BASE_BYTES and not strict:
        return None
    if len(rows) and len(data) - reached >= MOST_GAP + len(SIGNATURE):
        _is_next(data, reached, int(place[rows[-1]]), origin)
    return place[rows], size[rows]


def _is_next(data: bytes, end: int, begin: int, origin: str) -> None:
    if data.find(SIGNATURE, end, end + MOST_GAP + len(SIGNATURE)) < 0:
        raise LogError(
            f"{origin}: the object at byte {begin}, of {end - begin} bytes, is followed by no other, but by "
            f"{data[end : end + 4].hex(' ')}"
        )


def _follow(place, size, end, length: int, origin: str, strict: bool) -> NDArray[np.int64] | None:
    """Object by object, where payloads hold signatures."""
    following = np.searchsorted(place, end)
    rows, i = [], 0
    while i < len(place):
        if size[i] < BASE_BYTES:
            raise LogError(f"{origin}: the object at byte {place[i]} has a size of {size[i]} bytes")
        rows.append(i)
        j = int(following[i])
        if j < len(place) and place[j] - end[i] > MOST_GAP:
            if not strict:
                return None
            break
        i = j
    return np.array(rows, np.int64)


def _u4(raw: NDArray[np.uint8], at: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) little-endian words at places (n,)."""
    return sum((raw[at + i].astype(np.int64) << 8 * i for i in range(4)), np.zeros(len(at), np.int64))


def frames(
    data: bytes, place: NDArray[np.int64], size: NDArray[np.int64], omitted: Counter[str],
    passed: Counter[str], origin: str,
) -> Found:  # fmt: skip
    """The frames among whole objects of data; others are counted."""
    if len(place) and ((place - place[0]) % 4).any():
        data, place = _aligned(data, place, size)
    offset = int(place[0]) if len(place) else 0
    words = np.frombuffer(data, "<u4", (len(data) - offset) // 4, offset)
    at = (place - offset) // 4
    header, kind = words[at + 1], words[at + 3]
    known = np.isin(kind, list(FRAMES))
    for number, count in zip(*np.unique(kind[~known], return_counts=True), strict=True):
        passed[OTHERS.get(int(number), f"objects of type {number}")] += int(count)
    at, size, header, kind = at[known], size[known], header[known], kind[known]
    body = _bodies(header, kind, size, place[known], origin)
    ns = _since_start(words, at, place[known], origin)
    fields = _Fields(len(at))
    for number in np.unique(kind).tolist():
        rows = np.flatnonzero(kind == number)
        _READERS[number](fields, rows, words, at[rows] + body[rows] // 4, size[rows] - body[rows])
    return _kept(fields, ns, omitted, passed)


def _since_start(words, at, place, origin: str) -> NDArray[np.int64]:
    """(n,) times [ns]; LogError names the first object whose time is later than any measurement goes on."""
    stamp = words[at + 6].astype(np.uint64) | words[at + 7].astype(np.uint64) << np.uint64(32)
    unit_ns = np.where(words[at + 4] & 3 == _TEN_US, 10_000, 1).astype(np.uint64)
    late = stamp > np.uint64(_MOST_NS) // unit_ns
    if late.any():
        i = int(np.flatnonzero(late)[0])
        raise LogError(f"{origin}: the object at byte {place[i]} is of {stamp[i] * 1e-9 * unit_ns[i]:g} s")
    return (stamp * unit_ns).astype(np.int64)


def _aligned(data: bytes, place, size) -> tuple[bytes, NDArray[np.int64]]:
    """The objects again, each at a multiple of four bytes."""
    padded = -(-size // 4) * 4
    parts = [data[a : a + n].ljust(p, b"\0") for a, n, p in
             zip(place.tolist(), size.tolist(), padded.tolist(), strict=True)]  # fmt: skip
    return b"".join(parts), np.cumsum(padded) - padded


def _bodies(header, kind, size, place, origin: str) -> NDArray[np.int64]:
    """(n,) bytes before the body of each frame; LogError names the first object that has no room for it."""
    version = header >> 16
    least = np.select([version == v for v in _HEADER_BYTES], list(_HEADER_BYTES.values()), 1 << 30)
    told = (header & 0xFFFF).astype(np.int64)
    need = np.array([FRAMES.get(k, 0) for k in range(128)])[kind]
    wrong = (told < least) | (told % 4 != 0) | (told + need > size)
    if wrong.any():
        i = int(np.flatnonzero(wrong)[0])
        raise LogError(
            f"{origin}: the object at byte {place[i]}, of type {kind[i]}, has {size[i]} bytes and a header "
            f"of version {version[i]} with {told[i]}"
        )
    return told


class _Fields:
    """What is read of n objects, whatever their types; `drop` says why one is no frame to be kept."""

    KEEP, IS_FD, IS_CUT, IS_REQUEST = range(4)

    def __init__(self, n: int):
        self.channel = np.zeros(n, np.int64)
        self.can_id = np.zeros(n, np.uint32)
        self.length = np.zeros(n, np.uint8)
        self.data = np.zeros((n, WIDTH), np.uint8)
        self.direction = np.zeros(n, np.uint8)
        self.drop = np.zeros(n, np.uint8)

    def fill(self, rows, channel, can_id, length, low, high) -> None:
        self.channel[rows] = channel
        self.can_id[rows] = can_id
        self.length[rows] = length
        self.data[rows] = np.stack([low, high], 1).astype("<u4").view(np.uint8)


def _message(fields: _Fields, rows, words, at, _) -> None:
    """channel u16, flags u8 (direction in four bits, 0x80 remote), DLC u8; identifier; data."""
    first = words[at]
    remote = np.where(first >> 16 & 0x80, RTR_FLAG, 0).astype(np.uint32)
    can_id = words[at + 1] & _EXTENDED_AND_ID | remote
    fields.fill(rows, first & 0xFFFF, can_id, first >> 24, words[at + 2], words[at + 3])
    fields.direction[rows] = first >> 16 & 0x0F


def _fd_message(fields: _Fields, rows, words, at, room) -> None:
    """As a message; at 12 bits u8, flags u8 (1: EDL), bytes of data u8; at 20 the data."""
    first, fourth = words[at], words[at + 3]
    remote = np.where(first >> 16 & 0x80, RTR_FLAG, 0).astype(np.uint32)
    can_id = words[at + 1] & _EXTENDED_AND_ID | remote
    low, high = _data(words, at + 5, room - 20)
    fields.fill(rows, first & 0xFFFF, can_id, first >> 24, low, high)
    fields.direction[rows] = first >> 16 & 0x0F
    is_fd = fourth >> 8 & 1 != 0
    short = (np.minimum(first >> 24, WIDTH) > fourth >> 16 & 0xFF) & (remote == 0)
    fields.drop[rows] = np.select([is_fd, short], [_Fields.IS_FD, _Fields.IS_CUT], _Fields.KEEP)


def _fd_message_64(fields: _Fields, rows, words, at, room) -> None:
    """channel, DLC, bytes of data, count u8; identifier; at 12 flags (0x10 remote, 0x1000 EDL); at 34
    direction u8, place u8 of what may follow the data; at 40 the data; where it is cut the rest is zero."""
    first, flags, ninth = words[at], words[at + 3], words[at + 8]
    remote = np.where(flags & 0x10, RTR_FLAG, 0).astype(np.uint32)
    can_id = words[at + 1] & _EXTENDED_AND_ID | remote
    dlc, valid = first >> 8 & 0xFF, first >> 16 & 0xFF
    low, high = _data(words, at + 10, np.minimum(room - 40, valid))
    fields.fill(rows, first & 0xFF, can_id, dlc, low, high)
    fields.direction[rows] = ninth >> 16 & 0xFF
    short = (np.minimum(dlc, WIDTH) > valid) & (remote == 0)
    fields.drop[rows] = np.select([flags & 0x1000 != 0, short], [_Fields.IS_FD, _Fields.IS_CUT], _Fields.KEEP)


def _data(words, at, room) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Two words, of which `room` bytes are there."""
    room = np.clip(room, 0, WIDTH).astype(np.uint64)
    last = len(words) - 1
    low, high = (words[np.minimum(at + i, last)].astype(np.uint64) for i in (0, 1))
    word = (low | high << np.uint64(32)) & ~(np.uint64(2**64 - 1) << np.minimum(room * 8, 63))
    word = np.where(room == WIDTH, low | high << np.uint64(32), word)
    return (word & np.uint64(0xFFFF_FFFF)).astype(np.uint32), (word >> np.uint64(32)).astype(np.uint32)


def _error(fields: _Fields, rows, words, at, _) -> None:
    fields.channel[rows], fields.can_id[rows] = words[at] & 0xFFFF, ERR_FLAG


def _fd_error_64(fields: _Fields, rows, words, at, _) -> None:
    fields.channel[rows], fields.can_id[rows] = words[at] & 0xFF, ERR_FLAG


def _error_ext(fields: _Fields, rows, words, at, _) -> None:
    """channel u16; at 10 DLC u8; at 16 identifier; at 24 data."""
    can_id = words[at + 4] & _EXTENDED_AND_ID | ERR_FLAG
    fields.fill(rows, words[at] & 0xFFFF, can_id, words[at + 2] >> 16 & 0xFF, words[at + 6], words[at + 7])


_READERS = {
    _MESSAGE: _message, _MESSAGE2: _message, _FD_MESSAGE: _fd_message, _FD_MESSAGE_64: _fd_message_64,
    _ERROR: _error, _ERROR_EXT: _error_ext, _FD_ERROR_64: _fd_error_64,
}  # fmt: skip


def _kept(fields: _Fields, ns: NDArray[np.int64], omitted: Counter[str], passed: Counter[str]) -> Found:
    requests = (fields.direction == 2) & (fields.drop == _Fields.KEEP)
    fields.drop[requests] = _Fields.IS_REQUEST
    count = np.bincount(fields.drop, minlength=4)
    omitted.update({FD: int(count[_Fields.IS_FD]), CUT: int(count[_Fields.IS_CUT])})
    if count[_Fields.IS_REQUEST]:
        passed["requests to send"] += int(count[_Fields.IS_REQUEST])
    rows = slice(None) if count[0] == len(ns) else np.flatnonzero(fields.drop == _Fields.KEEP)
    can_id = fields.can_id[rows]
    batch = FrameBatch(np.zeros(len(can_id), np.int64), can_id, fields.length[rows], fields.data[rows])
    channel = np.maximum(fields.channel[rows] - 1, 0)
    return Found(ns[rows], channel, batch, fields.direction[rows] == 1)
