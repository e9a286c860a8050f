"""MF4 written: a group each of data, error and remote frames, named as in the standard on bus logging.

Records are compressed and written as they come; what describes them stands at the beginning of the file, in
room that is left for it, because it has to say how many there are and where.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, ERR_FLAG, RTR_FLAG, WIDTH
from gnss_hil.tools.recording.formats.piece import Piece

_COMMON = (("BusChannel", "u1"), ("ID", "<u4"), ("IDE", "u1"), ("DLC", "u1"), ("DataLength", "u1"))
_PAYLOAD = (("DataBytes", f"({WIDTH},)u1"),)
_FLAGS = (("Dir", "u1"), ("EDL", "u1"), ("BRS", "u1"), ("ESI", "u1"))
GROUPS = {
    "CAN_DataFrame": _COMMON + _PAYLOAD + _FLAGS,
    "CAN_ErrorFrame": _COMMON + _PAYLOAD + _FLAGS,
    "CAN_RemoteFrame": _COMMON + _FLAGS[:1],
}
_RECORDS = {name: np.dtype([("t_s", "<f8"), *fields]) for name, fields in GROUPS.items()}
BLOCK_BYTES = 1 << 22
LEVEL = 3
"""Of compression."""
_SECOND_US = 1_000_000
_TOOL = "<tool_id>gnss-hil</tool_id><tool_vendor>gnss-hil</tool_vendor><tool_version>1</tool_version>"
_UNSIGNED, _FLOAT, _BYTES = 0, 4, 10
_MASTER, _TIME, _BUS_EVENT, _BUS, _CAN, _DEFLATED = 2, 1, 1 << 10, 2, 2, 0


class Mf4Writer:
    """channels  number of each bus, from 0, as python-can has them."""

    def __init__(self, path: Path, channels: Mapping[bytes, int]):
        self._file = path.open("wb")
        self._channels = channels
        self._start_us: int | None = None
        self._waiting = {name: bytearray() for name in GROUPS}
        self._places: dict[str, list[tuple[int, int]]] = {name: [] for name in GROUPS}
        self._cycles = dict.fromkeys(GROUPS, 0)
        self._file.write(bytes(len(_head(0, {name: (0, 0) for name in GROUPS}))))

    def write(self, piece: Piece) -> None:
        if not len(piece.frames):
            return
        if self._start_us is None:
            self._start_us = int(piece.unix_us[0]) // _SECOND_US * _SECOND_US
        frames = piece.frames
        error, remote = frames.can_id & ERR_FLAG != 0, frames.can_id & RTR_FLAG != 0
        names, number = np.unique(piece.bus, return_inverse=True)
        channel = np.array([self._channels[name] for name in names.tolist()])[number]
        for group, mine in zip(GROUPS, (~error & ~remote, error, remote & ~error), strict=True):
            rows = np.flatnonzero(mine)
            if len(rows):
                elapsed_s = (piece.unix_us[rows] - self._start_us) / _SECOND_US
                self._extend(group, _records(group, piece.rows(rows), elapsed_s, channel[rows]))

    def _extend(self, group: str, records: NDArray) -> None:
        self._waiting[group] += records.tobytes()
        self._cycles[group] += len(records)
        whole = BLOCK_BYTES // records.itemsize * records.itemsize
        while len(self._waiting[group]) >= whole:
            self._flush(group, whole)

    def _flush(self, group: str, size: int) -> None:
        data = bytes(self._waiting[group][:size])
        del self._waiting[group][:size]
        packed = zlib.compress(data, LEVEL)
        self._places[group].append((self._file.tell(), len(data)))
        body = struct.pack("<2s2BL2Q", b"DT", _DEFLATED, 0, 0, len(data), len(packed)) + packed
        self._file.write(_block("##DZ", [], body))

    def close(self) -> None:
        lists = {}
        for group, waiting in self._waiting.items():
            if waiting:
                self._flush(group, len(waiting))
            lists[group] = self._cycles[group], self._listed(self._places[group])
        self._file.seek(0)
        self._file.write(_head((self._start_us or 0) * 1000, lists))
        self._file.close()

    def _listed(self, places: Sequence[tuple[int, int]]) -> int:
        """The list of a group's blocks, written; where it stands, 0 for no blocks."""
        if not places:
            return 0
        offsets = np.cumsum([0, *(size for _, size in places[:-1])]).tolist()
        at = self._file.tell()
        body = struct.pack(f"<B3xL{len(places)}Q", 0, len(places), *offsets)
        header = _block("##HL", [at + _size("##HL", 1, 8)], struct.pack("<HB5x", 0, _DEFLATED))
        self._file.write(header + _block("##DL", [0, *(place for place, _ in places)], body))
        return at


def _records(group: str, piece: Piece, elapsed_s: NDArray[np.float64], channel: NDArray) -> NDArray:
    """(n,) records of frames of one group."""
    frames, records = piece.frames, np.zeros(len(piece.frames), _RECORDS[group])
    values = {
        "BusChannel": channel, "ID": frames.can_id & EFF_MASK, "IDE": frames.can_id & EFF_FLAG != 0,
        "DLC": frames.length, "DataLength": frames.length, "DataBytes": frames.data, "Dir": piece.sent,
    }  # fmt: skip
    records["t_s"] = elapsed_s
    for name, _ in GROUPS[group]:
        if name in values:
            records[name] = values[name]
    return records


def _size(name: str, links: int, body: int) -> int:
    return -(-(24 + 8 * links + body) // 8) * 8


def _block(name: str, links: Sequence[int], body: bytes) -> bytes:
    """A block, with zeros up to a multiple of eight bytes."""
    length = 24 + 8 * len(links) + len(body)
    head = struct.pack(f"<4s4x2Q{len(links)}Q", name.encode(), length, len(links), *links)
    return (head + body).ljust(-(-length // 8) * 8, b"\0")


class _Assembly:
    """Blocks that link to blocks put before them."""

    def __init__(self, begin: int):
        self._begin = begin
        self.octets = bytearray()

    def put(self, name: str, links: Sequence[int], body: bytes = b"") -> int:
        """The place of a block that is added."""
        at = self._begin + len(self.octets)
        self.octets += _block(name, links, body)
        return at

    def text(self, text: str, name: str = "##TX") -> int:
        return self.put(name, [], text.encode() + b"\0")


def _head(start_ns: int, lists: Mapping[str, tuple[int, int]]) -> bytes:
    """All that describes; lists: how many records each group has, and where their list stands."""
    hd_bytes = _size("##HD", 6, 32)
    blocks = _Assembly(64 + hd_bytes)
    comment = blocks.text(f"<FHcomment><TX>created</TX>{_TOOL}</FHcomment>", "##MD")
    history = blocks.put("##FH", [0, comment], struct.pack("<Q2hB3x", start_ns, 0, 0, 0))
    group = 0
    for name, (cycles, data) in reversed(list(lists.items())):
        group = _data_group(blocks, name, cycles, data, group)
    identity = struct.pack("<8s8s8s4xH30x2H", b"MDF     ", b"4.10    ", b"gnss-hil", 410, 0, 0)
    body = struct.pack("<Q2h4B2d", start_ns, 0, 0, 0, 0, 0, 0, 0.0, 0.0)
    return identity + _block("##HD", [group, history, 0, 0, 0, 0], body) + bytes(blocks.octets)


def _data_group(blocks: _Assembly, name: str, cycles: int, data: int, following: int) -> int:
    kind = _RECORDS[name]
    text = blocks.text(name)
    source = blocks.put(
        "##SI", [blocks.text("CAN"), blocks.text("CAN"), 0], struct.pack("<3B5x", _BUS, _CAN, 0)
    )
    members = 0
    for field, _ in reversed(GROUPS[name]):
        place = kind.fields[field] if kind.fields else (np.dtype("u1"), 0)
        members = _channel(
            blocks, f"{name}.{field}", members, place[1], place[0].itemsize, source,
            _BYTES if field == "DataBytes" else _UNSIGNED,
        )  # fmt: skip
    frame = _channel(blocks, name, 0, 8, kind.itemsize - 8, source, _BYTES, members)
    time = _channel(blocks, "Timestamp", frame, 0, 8, source, _FLOAT)
    body = struct.pack("<2Q2H4x2L", 0, cycles, 1 << 1, ord("."), kind.itemsize, 0)
    group = blocks.put("##CG", [0, time, text, source, 0, 0], body)
    return blocks.put("##DG", [following, group, data, 0], bytes(8))


def _channel(
    blocks: _Assembly,
    name: str,
    following: int,
    byte: int,
    size: int,
    source: int,
    kind: int,
    members: int = 0,
) -> int:
    """A channel; of floating point it is the time."""
    is_time = kind == _FLOAT
    unit = blocks.text("s") if is_time else 0
    links = [following, members, blocks.text(name), source, 0, 0, unit, 0]
    what = (_MASTER, _TIME) if is_time else (0, 0)
    flags = 0 if is_time else _BUS_EVENT
    body = struct.pack("<4B4L2BH6d", *what, kind, 0, byte, 8 * size, flags, 0, 0, 0, 0, *[0.0] * 6)
    return blocks.put("##CN", links, body)
