"""Records of a channel group as frames."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, SFF_MASK, WIDTH, FrameBatch
from gnss_hil.tools.recording.formats.mf4.groups import (
    BIG_ENDIAN,
    FLOAT_BE,
    FLOAT_LE,
    MLSD,
    SIGNED,
    TEXT,
    VIRTUAL_MASTER,
    VLSD,
    Channel,
    Group,
)  # fmt: skip
from gnss_hil.tools.recording.formats.piece import CUT, FD, LogError, Piece, sound

INVALID = "marked invalid"
_FD_LENGTHS = np.array([*range(9), 12, 16, 20, 24, 32, 48, 64] + [64] * 240)
_WIDE, _MOST_S = 2**31, 1e11


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """n whole records of a group, one behind the other in `octets`."""

    octets: bytes
    group: Group
    first: int = 0

    def __len__(self) -> int:
        return len(self.octets) // self.group.size

    def column(self, kind: str, byte: int) -> NDArray:
        """(n,) values that lie at a byte of each record, as they are."""
        return np.ndarray((len(self),), kind, self.octets, byte, (self.group.size,))

    def octet_rows(self, byte: int, width: int) -> NDArray[np.uint8]:
        """(n, width) bytes from one on of each record."""
        return np.ndarray((len(self), width), np.uint8, self.octets, byte, (self.group.size, 1))


def integers(records: Records, channel: Channel) -> NDArray[np.int64]:
    """(n,) raw values of a channel of whole numbers of at most 64 bits."""
    size = (channel.bit + channel.bits + 7) // 8
    order = ">" if channel.type in BIG_ENDIAN else "<"
    if size in (1, 2, 4) and channel.bits == 8 * size and channel.type not in SIGNED:  # as most are
        return records.column(f"{order}u{size}", channel.byte).astype(np.int64)
    if size in (1, 2, 4, 8):
        raw = records.column(f"{order}u{size}", channel.byte).astype(np.uint64)
    else:
        rows = records.octet_rows(channel.byte, min(size, 8))
        padded = np.zeros((len(rows), 8), np.uint8)
        if order == ">":
            padded[:, 8 - rows.shape[1] :] = rows
        else:
            padded[:, : rows.shape[1]] = rows
        raw = padded.view(f"{order}u8")[:, 0].astype(np.uint64)
    raw >>= np.uint64(channel.bit)
    if channel.bits < 64:
        raw &= np.uint64((1 << channel.bits) - 1)
    values = raw.view(np.int64)
    if channel.type in SIGNED and 0 < channel.bits < 64:
        values = (values ^ (1 << channel.bits - 1)) - (1 << channel.bits - 1)
    return values


def whole_numbers(records: Records, channel: Channel) -> NDArray[np.int64]:
    """(n,) values of a channel, converted."""
    values = integers(records, channel)
    if (channel.offset, channel.factor) == (0.0, 1.0):
        return values
    with np.errstate(over="ignore", invalid="ignore"):
        converted = values * channel.factor + channel.offset
    return np.rint(np.clip(np.nan_to_num(converted), -(2.0**62), 2.0**62)).astype(np.int64)


def seconds(records: Records, origin: str) -> NDArray[np.float64]:
    """(n,) times since the start [s]."""
    channel = records.group.time
    assert channel is not None
    if channel.kind == VIRTUAL_MASTER:
        values = (records.first + np.arange(len(records))).astype(float)
    elif channel.type in (FLOAT_LE, FLOAT_BE):
        if channel.bits not in (32, 64) or channel.bit:
            raise LogError(f"{origin}: is damaged: times of {channel.bits} bits")
        order = "<" if channel.type == FLOAT_LE else ">"
        values = records.column(f"{order}f{channel.bits // 8}", channel.byte).astype(float)
    else:
        values = integers(records, channel).astype(float)
    if (channel.offset, channel.factor) != (0.0, 1.0):
        with np.errstate(over="ignore", invalid="ignore"):
            values = values * channel.factor + channel.offset
    if len(values) and not -_MOST_S < values.min() <= values.max() < _MOST_S:  # nan is none of it
        wrong = values[~(np.abs(values) < _MOST_S)][0]
        raise LogError(f"{origin}: is damaged: a frame at {wrong:g} s")
    return values


def invalid(records: Records, names: tuple[str, ...]) -> NDArray[np.bool_]:
    """(n,) whether any of the named channels, or the time, is marked as no value."""
    group = records.group
    marked = np.zeros(len(records), bool)
    for channel in (group.time, *(group.channels.get(name) for name in names)):
        if channel is None:
            continue
        if channel.never:
            marked[:] = True
        elif channel.invalid is not None:
            byte = records.column("u1", group.valued + channel.invalid // 8)
            marked |= (byte >> (channel.invalid % 8) & 1).astype(bool)
    return marked


@dataclass(frozen=True, slots=True, eq=False)
class Payloads:
    """data (n, 8) first bytes, length (n,) of all of them; missing (n,) where there are none."""

    data: NDArray[np.uint8]
    length: NDArray[np.int64]
    missing: NDArray[np.bool_]


def fixed_payloads(records: Records) -> Payloads:
    """Payloads that lie in the records; of a number, its bytes as they lie there."""
    n, channel = len(records), records.group.channels.get("DataBytes")
    if channel is not None and channel.bits == 8 * WIDTH:
        data = np.ascontiguousarray(records.octet_rows(channel.byte, WIDTH))
        return Payloads(data, np.full(n, WIDTH), np.zeros(n, bool))
    data = np.zeros((n, WIDTH), np.uint8)
    if channel is None:
        return Payloads(data, np.zeros(n, np.int64), np.zeros(n, bool))
    width = channel.bits // 8
    data[:, : min(width, WIDTH)] = records.octet_rows(channel.byte, min(width, WIDTH))
    return Payloads(data, np.full(n, width), np.zeros(n, bool))


def frames(records: Records, payloads: Payloads, start_us: int, origin: str, omitted: Counter[str]) -> Piece:
    """The frames of records, and what is left of them counted."""
    channels, n, kind = records.group.channels, len(records), records.group.kind

    def number(name: str, otherwise: NDArray | int) -> NDArray[np.int64]:
        channel = channels.get(name)
        if channel is None or channel.kind in (VLSD, MLSD) or not 0 < channel.bits <= 64:
            return np.broadcast_to(np.asarray(otherwise, np.int64), n)
        values = whole_numbers(records, channel)
        marked = invalid_one(records, channel)
        return values if marked is None else np.where(marked, otherwise, values)

    raw_id = number("ID", 0).astype(np.uint32)
    flagged = raw_id & EFF_FLAG != 0
    extended = number("IDE", flagged | (raw_id & EFF_MASK > SFF_MASK)).astype(bool) | flagged
    dlc = number("DLC", 0)
    by_dlc = _FD_LENGTHS[np.clip(dlc, 0, 255)]
    told = number("DataLength", by_dlc if "DLC" in channels else payloads.length)
    can_id = raw_id & EFF_MASK | extended.astype(np.uint32) << 31
    remote = kind == "CAN_RemoteFrame"
    if kind == "CAN_ErrorFrame":
        can_id |= ERR_FLAG
        length = np.minimum(told, payloads.length)
    elif remote:
        can_id |= RTR_FLAG
        length = dlc if "DLC" in channels else told
    else:
        length = told
    needed = ("ID", "DataBytes", "DataLength", kind) if kind == "CAN_DataFrame" else (kind,)
    marked = invalid(records, needed)
    is_fd = ~marked & (kind == "CAN_DataFrame") & ((number("EDL", 0) != 0) | (length > WIDTH))
    cut = (
        ~marked
        & ~is_fd
        & (kind == "CAN_DataFrame")
        & (payloads.missing | (length > payloads.length) | (length < 0))
    )
    omitted.update({INVALID: int(marked.sum()), FD: int(is_fd.sum()), CUT: int(cut.sum())})
    left_out = marked | is_fd | cut
    rows = np.flatnonzero(~left_out) if left_out.any() else slice(None)
    elapsed_us = np.rint(seconds(records, origin) * 1e6).astype(np.int64)
    ids = can_id[rows]
    frames = FrameBatch(
        np.zeros(len(ids), np.int64), ids,
        np.clip(length[rows], 0, 255).astype(np.uint8), payloads.data[rows],
    )  # fmt: skip
    channel, sent = np.clip(number("BusChannel", 0)[rows], 0, _WIDE), _sent(records, number("Dir", 0))[rows]
    return sound(elapsed_us[rows] + start_us, channel, frames, sent, origin, omitted)


def _sent(records: Records, number: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) whether the direction is 1, or Tx where a program writes it in letters."""
    channel = records.group.channels.get("Dir")
    if channel is None or channel.type not in TEXT or channel.kind in (VLSD, MLSD) or channel.bits < 16:
        return number == 1
    return (records.octet_rows(channel.byte, 2) == list(b"Tx")).all(axis=1)


def invalid_one(records: Records, channel: Channel) -> NDArray[np.bool_] | None:
    """(n,) whether the channel's value is marked as none; None where it cannot be."""
    if channel.never:
        return np.ones(len(records), bool)
    if channel.invalid is None:
        return None
    byte = records.column("u1", records.group.valued + channel.invalid // 8)
    return (byte >> (channel.invalid % 8) & 1).astype(bool)
