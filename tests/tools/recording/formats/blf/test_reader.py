"""BLF: python-can judges what it writes and reads; what it cannot is made by hand, object by object."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from functools import partial
from pathlib import Path

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import EFF_FLAG, RTR_FLAG, FrameBatch
from gnss_hil.tools.recording.formats.blf import containers, reader
from gnss_hil.tools.recording.formats.blf.writer import BlfWriter
from gnss_hil.tools.recording.formats.order import joined
from gnss_hil.tools.recording.formats.piece import CUT, FD, Findings, LogError, Piece
from gnss_hil.tools.recording.formats.recording import Channels
from tests.support.can_messages import drawn, hexes, read_whole, rows_of_messages, rows_of_piece

pytestmark = pytest.mark.verifies(
    "tools/recording/formats/blf/reader.py",
    "tools/recording/formats/blf/objects.py",
    "tools/recording/formats/blf/containers.py",
    "tools/recording/formats/blf/writer.py",
    what="Vector BLF, read and written",
    by=(
        "python-can's reader and writer, both ways; by hand what python-can reads wrong or not: errors "
        "without more, 10 us, gaps, containers cut anywhere; mutated bytes. CANoe's own files were not tried"
    ),
    status="validated",
)

START = 1_351_642_484
PAYLOAD = bytes.fromhex("8A000304050607FF")

some_messages = partial(drawn, START)


def body(
    kind: int, fields: bytes, ns: int = 0, *, flags: int = 2, version: int = 1, gap: int | None = None
) -> bytes:
    """An object with its header, and the gap behind it as CANoe leaves it."""
    header = {1: 32, 2: 40}[version]
    size = header + len(fields)
    head = struct.pack("<4s2H2L", b"LOBJ", header, version, size, kind)
    rest = struct.pack("<L2HQ", flags, 0, 0, ns) if version == 1 else struct.pack("<LBxHQ8x", flags, 0, 0, ns)
    return head + rest + fields + bytes(size % 4 if gap is None else gap)


def message(
    can_id: int = 0x101, data: bytes = PAYLOAD, how: int = 0, channel: int = 1, dlc: int | None = None
) -> bytes:
    return struct.pack("<HBBL8s", channel, how, len(data) if dlc is None else dlc, can_id, data)


def fd_message(can_id: int, data: bytes, fd_flags: int, how: int = 0) -> bytes:
    return struct.pack("<HBBLLBBB5x64s", 1, how, min(len(data), 15), can_id, 0, 0, fd_flags, len(data), data)


def fd_message_64(
    can_id: int, data: bytes, flags: int, dlc: int | None = None, direction: int = 0, valid=None
) -> bytes:
    dlc, valid = len(data) if dlc is None else dlc, len(data) if valid is None else valid
    return (
        struct.pack("<BBBBLLLLLLLHBBL", 3, dlc, valid, 0, can_id, 0, flags, 0, 0, 0, 0, 0, direction, 0, 0)
        + data
    )


def container(data: bytes, method: int = 2, cut: int = 0) -> bytes:
    packed = zlib.compress(data) if method == 2 else data
    size = 32 + len(packed)
    head = struct.pack("<4s2H2LH6xL4x", b"LOBJ", 16, 1, size, 10, method, len(data))
    return (head + packed)[: size - cut] + (b"" if cut else bytes(size % 4))


def file(*parts: bytes, announced: int | None = None, start=(2012, 10, 3, 31, 0, 14, 44, 0)) -> bytes:
    whole = b"".join(parts)
    size = 144 + len(whole) if announced is None else announced
    return struct.pack("<4sL8BQQ2L8H8H72x", b"LOGG", 144, *[0] * 8, size, 0, 0, 0, *start, *[0] * 8) + whole


@pytest.fixture
def read(tmp_path):
    def read(octets: bytes) -> tuple[Piece, Findings]:
        return read_whole(reader.read, tmp_path / "a.blf", octets)

    return read


@pytest.mark.parametrize("level", [0, 6])
@pytest.mark.parametrize("container_bytes", [1000, 131072])
def test_python_cans_files_are_read_as_it_reads_them(tmp_path, level, container_bytes):
    path = tmp_path / "theirs.blf"
    with can.BLFWriter(path, compression_level=level) as writer:
        writer.max_container_size = container_bytes
        for i, message in enumerate(some_messages(3000)):
            writer(message)
            if i % 100 == 0:
                writer.log_event("a marker, of any length"[: 5 + i // 100 % 9], message.timestamp)
    theirs, found = list(can.BLFReader(path)), Findings()
    ours = joined(list(reader.read(path, found)))
    kept = [m for m in theirs if not m.is_fd]
    assert rows_of_piece(ours) == rows_of_messages(kept)
    assert dict(+found.omitted) == {FD: len(theirs) - len(kept)} and dict(found.passed) == {"markers": 30}
    assert not found.remarks and found.share == 1


def test_python_can_reads_ours(tmp_path):
    source, path = tmp_path / "theirs.blf", tmp_path / "ours.blf"
    with can.BLFWriter(source) as log:
        for message in some_messages(5000, seed=4):
            log(message)
    piece = joined(list(reader.read(source, Findings())))
    writer = BlfWriter(path, Channels())
    writer.write(piece.rows(slice(0, 2000)))
    writer.write(piece.rows(slice(2000, None)))
    writer.close()
    theirs = can.BLFReader(path)
    assert rows_of_messages(list(theirs)) == rows_of_piece(piece)
    assert theirs.object_count == len(piece.frames) and theirs.file_size == path.stat().st_size
    assert theirs.start_timestamp == START and abs(theirs.stop_timestamp - piece.unix_us[-1] / 1e6) < 1e-3


def test_the_writer_has_no_room_before_its_start(tmp_path):
    piece = Piece(np.array([START * 10**6, START * 10**6 - 1]), np.full(2, b"can0", "S15"),
                  FrameBatch(np.zeros(2, np.int64), np.ones(2, np.uint32), np.zeros(2, np.uint8),
                             np.zeros((2, 8), np.uint8)), np.zeros(2, bool))  # fmt: skip
    with pytest.raises(LogError, match="1e-06 s before the first"):
        BlfWriter(tmp_path / "a.blf", Channels()).write(piece)


OBJECTS = [
    body(1, message(), 100_000),
    body(86, message(0x18EBFF00 | 1 << 31, b"\1\2", how=1) + bytes(8), 200_400, version=2),
    body(1, message(how=0x80, data=b"", dlc=3), 30, flags=1),  # 10 us
    body(1, message(dlc=15), 400_000),  # lengths beyond eight
    body(1, message(how=2), 450_000),  # a request to send
    body(65, b"text of seven"[:7], 460_000),
    body(2, struct.pack("<HH4x", 2, 0), 500_000),
    body(73, struct.pack("<HHLBBBxLLH2x8s", 1, 0, 0, 0, 0, 2, 0, 0x80, 0, b"\5\6"), 600_000),
    body(100, fd_message(0x102, PAYLOAD, 0, how=1), 700_000),  # a classical frame in an object of FD
    body(100, fd_message(0x103, PAYLOAD, 1), 750_000),
    body(101, fd_message_64(0x104, PAYLOAD, 0), 800_000),
    body(101, fd_message_64(0x105, PAYLOAD * 2, 0x1000, 10), 850_000),
    body(101, fd_message_64(0x106 | 1 << 31, b"", 0x10, 4, direction=1), 900_000),
    body(101, fd_message_64(0x107, b"\1\2\3", 0, 5, valid=5), 1_000_000),  # cut: the rest is zero
    body(101, fd_message_64(0x108, b"\1\2\3", 0, 5), 1_050_000),  # shorter than it says
    body(104, struct.pack("<BBBBHHHBBLLL", 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), 1_100_000),
    body(4, bytes(32), 1_200_000),
    body(200, b"LOBJ" + bytes(17), 1_300_000),  # unknown, with the signature in it
    body(1, message(data=b"LOBJLOBJ"), 1_400_000),
]
WANTED = [
    (100, "can0", "101#8A000304050607FF", False), (200, "can0", "98EBFF00#0102", True),
    (300, "can0", f"{0x101 | RTR_FLAG:X}#000000", False), (400, "can0", "101#8A000304050607FF", False),
    (500, "can1", "20000000#", False), (600, "can0", "20000080#0506", False),
    (700, "can0", "102#8A000304050607FF", True), (800, "can2", "104#8A000304050607FF", False),
    (900, "can2", f"{0x106 | EFF_FLAG | RTR_FLAG:X}#00000000", True), (1000, "can2", "107#0102030000", False),
    (1100, "can1", "20000000#", False), (1400, "can0", "101#4C4F424A4C4F424A", False),
]  # fmt: skip
OMITTED = {FD: 2, CUT: 1}
PASSED = {"requests to send": 1, "texts": 1, "statistics": 1, "objects of type 200": 1}


@pytest.mark.parametrize("step", [7, 64, 1000, 10**6])
@pytest.mark.parametrize("joined_bytes", [1, 1 << 20])
@pytest.mark.parametrize("method", [0, 2])
def test_objects_of_all_kinds_in_containers_cut_anywhere(read, monkeypatch, step, joined_bytes, method):
    monkeypatch.setattr(reader, "JOINED_BYTES", joined_bytes)
    data = b"".join(OBJECTS)
    piece, found = read(file(*(container(data[i : i + step], method) for i in range(0, len(data), step))))
    assert rows_of_piece(piece) == [(START * 10**6 + t, *row) for t, *row in WANTED]
    assert dict(+found.omitted) == OMITTED and dict(found.passed) == PASSED and not found.remarks


@pytest.mark.parametrize("gaps", [(0, 0), (3, 2), (1, 3)])
def test_gaps_behind_objects_may_be_of_any_length(read, gaps):
    """Text of odd lengths, followed by no gap, that to the next word, or the size modulo four."""
    parts = [
        part for i in range(6) for part in (body(65, bytes(5 + i % 2), gap=gaps[i % 2]), body(1, message(i)))
    ]
    piece, found = read(file(container(b"".join(parts))))
    assert [name.split("#")[0] for name in hexes(piece)] == list("012345") and found.passed == {"texts": 6}


def test_objects_outside_of_containers_count_too(read):
    piece, found = read(file(body(65, bytes(5)), body(1, message(5)), container(body(1, message(6)))))
    assert [name.split("#")[0] for name in hexes(piece)] == ["5", "6"] and found.passed == {"texts": 1}


def test_long_objects_that_are_no_frames_are_not_held(read, monkeypatch):
    monkeypatch.setattr(reader, "JOINED_BYTES", 1)
    long = body(200, bytes(300_000))
    piece, found = read(file(*(container(d) for d in (body(1, message(1)) + long[:100], long[100:200_000],
                                                     long[200_000:] + body(1, message(2))))))  # fmt: skip
    assert len(piece.frames) == 2 and found.passed == {"objects of type 200": 1}
    with pytest.raises(LogError, match="of type 1, has 70032 bytes"):
        read(file(container(body(1, bytes(70_000))[:1000])))


def test_what_is_cut_short_is_told(read):
    data = b"".join(body(1, message(i)) for i in range(100))
    whole = file(container(data[:2400]), container(data[2400:]))
    piece, found = read(whole[:-20])
    assert 50 <= len(piece.frames) < 100 and "cut short: the object at byte" in found.remarks[0]
    piece, found = read(file(container(data[:-10])))
    assert len(piece.frames) == 99
    assert found.remarks == ["is cut short: its last object is missing 10 bytes"]
    piece, found = read(whole + b"LOBJ\20\0")
    assert len(piece.frames) == 100 and "is missing its size" in found.remarks[0]
    assert read(file(container(data), announced=10**6))[1].remarks[0].startswith("is cut short: ")
    assert read(file(container(data)) + bytes(4096))[1].remarks == [
        f"ends in zeros at byte {len(file(container(data)))}"
    ]
    assert read(file(container(data), start=[0] * 8))[1].remarks == [
        "has no start of the measurement: times count from 1970-01-01 UTC"
    ]


@pytest.mark.parametrize(
    ("octets", "says"),
    [
        (b"", "not Vector BLF: begins with nothing"),
        (b"LOGX" + bytes(200), "not Vector BLF: begins with 4c 4f 47 58"),
        (struct.pack("<4sL", b"LOGG", 2**31) + bytes(200), "a header of 2147483648 bytes at byte 4"),
        (file(b"rubbish, and more of it, of no use"), "no object at byte 144, but 72 75 62 62"),
        (file(container(b"rubbish, and more of it, of no use")), "no object where one has to begin, but 72"),
        (file(container(body(1, message()) + b"rubbish, and more of it")), "followed by no other, but by 72"),
        (file(container(body(1, message())[:40])[:32] + b"no zlib at all"), "container at byte 144: "),
        (file(container(body(1, message()), method=7)), "has compression 7; known are 0 and 2"),
        (file(struct.pack("<4s2H2L", b"LOBJ", 16, 1, 0, 10) + bytes(100)), "at byte 144 has a size of 0"),
        (file(container(struct.pack("<4s2H2L", b"LOBJ", 32, 1, 0, 1) * 9)), "object at byte 0 has a size of"),
        (file(container(body(1, bytes(4)))), "of type 1, has 36 bytes and a header of version 1 with 32"),
        (file(container(body(1, message(), 2 * 10**18))), "object at byte 0 is of 2e.09 s"),
    ],
)  # fmt: skip
def test_damaged_files_are_refused_in_one_line(read, octets, says):
    with pytest.raises(LogError, match=says) as caught:
        read(octets)
    assert "\n" not in str(caught.value) and "a.blf" in str(caught.value)


def test_a_bomb_is_refused(read, monkeypatch):
    monkeypatch.setattr(containers, "MOST_BYTES", 1 << 20)
    with pytest.raises(LogError, match="container at byte 144 amounts to more than 1 MiB"):
        read(file(container(body(200, bytes(2 << 20)))))


SOUND = file(*(container(b"".join(OBJECTS), method) for method in (0, 2)))


@given(
    st.lists(st.tuples(st.integers(0, len(SOUND) - 1), st.integers(0, 255)), max_size=12),
    st.integers(0, len(SOUND)),
)
@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_mutated_files_end_in_frames_or_in_one_line(tmp_path: Path, changes, length):
    octets = bytearray(SOUND)
    for at, value in changes:
        octets[at] = value
    path, found = tmp_path / "a.blf", Findings()
    path.write_bytes(octets[:length])
    try:
        pieces = list(reader.read(path, found))
    except LogError as error:
        assert "\n" not in str(error)
        return
    assert all("\n" not in remark for remark in found.remarks)
    n = sum(len(piece.frames) for piece in pieces)
    assert n + sum(found.omitted.values()) + sum(found.passed.values()) <= 2 * len(OBJECTS)
    if length < len(SOUND) - 2:
        assert found.remarks or Counter(found.passed)["objects of type 200"] == 0 or n == 0
