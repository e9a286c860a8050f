"""MDF files made by hand, block by block, for what asammdf does not write."""

from __future__ import annotations

import struct
import zlib

START_NS = 1_351_642_484_000_000_000
FIXED, VLSD, MASTER, MLSD = 0, 1, 2, 5
UNSIGNED, FLOAT, BYTES = 0, 4, 10
VLSD_GROUP, BUS_EVENT = 1, 2


def block(name: str, links, body: bytes = b"", length: int | None = None) -> bytes:
    size = 24 + 8 * len(links) + len(body)
    head = struct.pack(
        f"<4s4x2Q{len(links)}Q", name.encode(), size if length is None else length, len(links), *links
    )
    return (head + body).ljust(-(-size // 8) * 8, b"\0")


class Assembly:
    """Blocks behind the first two; `file` closes it."""

    def __init__(self):
        self.octets = bytearray()

    def put(self, name: str, links, body: bytes = b"", length: int | None = None) -> int:
        at = 64 + 104 + len(self.octets)
        self.octets += block(name, links, body, length)
        return at

    def patch(self, at: int, value: int) -> None:
        """Another word at a place."""
        struct.pack_into("<Q", self.octets, at - 64 - 104, value)

    def text(self, text: str) -> int:
        return self.put("##TX", [], text.encode() + b"\0")

    def channel(
        self, name, byte, bits, *, following=0, kind=FIXED, type=UNSIGNED, parts=0, data=0, invalid=None,
        conversion=0, bit=0,
    ) -> int:  # fmt: skip
        sync = 1 if kind == MASTER else 0
        flags = 0 if invalid is None else 2
        body = struct.pack(
            "<4B4L2BH6d", kind, sync, type, bit, byte, bits, flags, invalid or 0, 0, 0, 0, *[0.0] * 6
        )
        return self.put("##CN", [following, parts, self.text(name), 0, conversion, data, 0, 0], body)

    def channels(self, *rows: dict) -> int:
        """A list of channels, linked; the first one's place."""
        at = 0
        for row in reversed(rows):
            at = self.channel(**row, following=at)
        return at

    def linear(self, offset: float, factor: float) -> int:
        return self.put("##CC", [0] * 4, struct.pack("<2B3H4d", 1, 0, 0, 0, 2, 0, 0, offset, factor))

    def group(
        self, channels, cycles, size, *, following=0, record=0, invalid_bytes=0, flags=BUS_EVENT
    ) -> int:
        name, path = self.text("CAN"), self.text("CAN")
        source = self.put("##SI", [name, path, 0], struct.pack("<3B5x", 2, 2, 0))
        body = struct.pack("<2Q2H4x2L", record, cycles, flags, 0, size, invalid_bytes)
        return self.put("##CG", [following, channels, 0, source, 0, 0], body)

    def data_group(self, group: int, data: int, *, id_bytes: int = 0, following: int = 0) -> int:
        return self.put("##DG", [following, group, data, 0], struct.pack("<B7x", id_bytes))

    def data_last(self, group: int, octets: bytes, *, id_bytes: int = 0, length: int | None = None) -> int:
        """A data group whose data are the end of the file."""
        at = self.data_group(group, 0, id_bytes=id_bytes)
        self.patch(at + 24 + 16, self.put("##DT", [], octets, length))
        return at

    def dz(self, data: bytes, columns: int = 0, of: bytes = b"DT", length: int | None = None) -> int:
        """A compressed block, transposed if it has columns."""
        plain = data
        if columns:
            rows = len(data) // columns
            whole = b"".join(data[i : rows * columns : columns] for i in range(columns))
            plain = whole + data[rows * columns :]
        packed = zlib.compress(plain)
        size = len(data) if length is None else length
        return self.put(
            "##DZ", [], struct.pack("<2s2BL2Q", of, bool(columns), 0, columns, size, len(packed)) + packed
        )

    def file(
        self, first_group: int, *, undone: int | None = None, flags: int = 0, version: int = 410
    ) -> bytes:
        name = b"MDF     " if undone is None else b"UnFinMF "
        identity = struct.pack("<8s8s8s4xH30x2H", name, b"4.10    ", b"by hand ", version, undone or 0, 0)
        head = block(
            "##HD",
            [first_group, 0, 0, 0, 0, 0],
            struct.pack("<Q2h4B2d", START_NS, 0, 0, flags, 0, 0, 0, 0, 0),
        )
        return identity + head + bytes(self.octets)


def data_frame(assembly: Assembly, *, payload: dict, extra: tuple[dict, ...] = (), **time) -> int:
    """Channels of a record: time f8, ID u4, bus and IDE bits, length u1, payload from byte 14 on."""
    members = assembly.channels(
        {"name": "CAN_DataFrame.ID", "byte": 8, "bits": 29},
        {"name": "CAN_DataFrame.BusChannel", "byte": 12, "bits": 4},
        {"name": "CAN_DataFrame.IDE", "byte": 12, "bits": 1, "bit": 7},
        {"name": "CAN_DataFrame.DataLength", "byte": 13, "bits": 8},
        {"name": "CAN_DataFrame.DataBytes", "byte": 14, "type": BYTES, **payload},
        *extra,
    )
    frame = {"name": "CAN_DataFrame", "byte": 8, "bits": 8, "type": BYTES, "parts": members}
    return assembly.channels(
        {"name": "t", "byte": 0, "bits": 64, "kind": MASTER, "type": FLOAT, **time}, frame
    )


def record(
    t_s: float, can_id: int, length: int, payload: bytes, bus: int = 1, extended: bool = False
) -> bytes:
    return struct.pack("<dL2B", t_s, can_id, bus | extended << 7, length) + payload
