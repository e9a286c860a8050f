"""MF4: asammdf and python-can judge what they write and read; what they cannot is made by hand."""

from __future__ import annotations

import logging
import struct
from functools import partial

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import EFF_FLAG, RTR_FLAG
from gnss_hil.tools.recording.formats.mf4 import data as mf4_data
from gnss_hil.tools.recording.formats.mf4 import reader, variable, writer
from gnss_hil.tools.recording.formats.mf4.frames import INVALID
from gnss_hil.tools.recording.formats.mf4.writer import Mf4Writer
from gnss_hil.tools.recording.formats.order import joined
from gnss_hil.tools.recording.formats.piece import CUT, FD, Findings, LogError, Piece
from gnss_hil.tools.recording.formats.recording import Channels
from tests.support import can_messages
from tests.support.can_messages import read_whole
from tests.support.outside import peer
from tests.tools.recording.formats.mf4.assembly import (
    BYTES,
    FLOAT,
    MASTER,
    MLSD,
    START_NS,
    UNSIGNED,
    VLSD,
    VLSD_GROUP,
    Assembly,
    data_frame,
    record,
)

pytestmark = pytest.mark.verifies(
    "tools/recording/formats/ahead.py",
    "tools/recording/formats/mf4/reader.py",
    "tools/recording/formats/mf4/blocks.py",
    "tools/recording/formats/mf4/data.py",
    "tools/recording/formats/mf4/frames.py",
    "tools/recording/formats/mf4/groups.py",
    "tools/recording/formats/mf4/records.py",
    "tools/recording/formats/mf4/variable.py",
    "tools/recording/formats/mf4/writer.py",
    what="ASAM MDF 4 with bus logging, read and written",
    by=(
        "python-can's and asammdf's readers and writers, both ways, every compression; by hand, and read by "
        "asammdf too where it can: unsorted records, values of variable length, invalidation bits, "
        "unfinished files; mutated bytes. Files of loggers were not tried"
    ),
    status="validated",
)

START_US = START_NS // 1000

some_messages = partial(can_messages.drawn, START_US / 1e6, sent_errors=True)
told = partial(can_messages.rows_of_piece, since_us=START_US)
of_python_can = partial(can_messages.rows_of_messages, since_us=START_US)

TIME = {"name": "t", "byte": 0, "bits": 64, "kind": MASTER, "type": FLOAT}


@pytest.fixture(autouse=True)
def quiet():
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)


@pytest.fixture
def read(tmp_path):
    def read(octets: bytes) -> tuple[Piece, Findings]:
        return read_whole(reader.read, tmp_path / "a.mf4", octets)

    return read


@pytest.mark.parametrize("level", [0, 1, 2])
def test_python_cans_files_are_read_as_it_reads_them(tmp_path, level):
    peer("asammdf")
    path = tmp_path / "theirs.mf4"
    with can.MF4Writer(path, compression_level=level) as log:
        for message in some_messages(400):
            log(message)
    theirs, found = list(can.MF4Reader(path)), Findings()
    ours = joined(list(reader.read(path, found)))
    kept = [m for m in theirs if not m.is_fd]
    assert told(ours) == of_python_can(kept)
    assert dict(+found.omitted) == {FD: len(theirs) - len(kept)}
    assert not found.remarks and not found.passed and 0 < found.share <= 1


def test_python_can_reads_ours(tmp_path, monkeypatch):
    """Several blocks of every group, of which the last ones are short."""
    peer("asammdf")
    monkeypatch.setattr(writer, "BLOCK_BYTES", 2000)
    source, path = tmp_path / "theirs.blf", tmp_path / "ours.mf4"
    with can.BLFWriter(source) as log:
        for message in some_messages(2000, seed=4):
            log(message)
    from gnss_hil.tools.recording.formats.blf import reader as blf

    piece = joined(list(blf.read(source, Findings())))
    log = Mf4Writer(path, Channels())
    log.write(piece.rows(slice(0, 700)))
    log.write(piece.rows(slice(700, None)))
    log.close()
    theirs = list(can.MF4Reader(path))
    assert of_python_can(theirs) == told(piece)
    found = Findings()
    assert told(joined(list(reader.read(path, found)))) == told(piece) and not found.remarks


PAYLOAD = bytes(range(1, 9))
THREE = [
    (100_000, "can1", "123#0102030405060708", False), (200_000, "can2", "123#0102", False),
    (200_001, "can1", f"{0x18FEF1AA | EFF_FLAG:X}#01020304", False),
]  # fmt: skip
RECORDS = [record(0.1, 0x123, 8, PAYLOAD), record(0.2, 0x123, 2, PAYLOAD, bus=2),
           record(0.200001, 0x18FEF1AA, 4, PAYLOAD, extended=True)]  # fmt: skip
SIZE = len(RECORDS[0])


def fixed(a: Assembly, data: int, cycles: int = 3, **more) -> int:
    return a.data_group(a.group(data_frame(a, payload={"bits": 64}), cycles, SIZE, **more), data)


def plain() -> bytes:
    a = Assembly()
    return a.file(a.data_last(a.group(data_frame(a, payload={"bits": 64}), 3, SIZE), b"".join(RECORDS)))


def lists(cut: int, columns: int, deflate: bool) -> bytes:
    """Blocks of a list that records go across, in two parts of the list."""
    a, data = Assembly(), b"".join(RECORDS)
    parts = [data[i : i + cut] for i in range(0, len(data), cut)]
    places = [a.dz(part, columns) if deflate else a.put("##DT", [], part) for part in parts]
    half = len(places) // 2
    second = a.put("##DL", [0, *places[half:]], struct.pack("<B3xL", 0, len(places) - half))
    first = a.put("##DL", [second, *places[:half]], struct.pack("<B3xL", 0, half))
    head = a.put("##HL", [first], struct.pack("<HB5x", 0, 1))
    return a.file(fixed(a, head if deflate else first))


def unsorted(id_bytes: int = 1, undone: int | None = None, order: str = "after") -> bytes:
    """Records of frames, their payloads and another group's, one among the other."""
    a = Assembly()
    values = a.group(0, 3, 0, record=7, flags=VLSD_GROUP)
    channels = data_frame(a, payload={"bits": 64, "kind": VLSD, "data": values})
    other = a.group(a.channels(TIME), 3, 8,
                    record=9, following=values, flags=0)  # fmt: skip
    frames = a.group(channels, 0 if undone is not None else 3, 22, record=3, following=other)

    def tag(number):
        return number.to_bytes(id_bytes, "little")

    octets, offset = b"", 0
    for whole in RECORDS:
        length = whole[13]
        frame = tag(3) + whole[:14] + struct.pack("<Q", offset)
        value = tag(7) + struct.pack("<L", length) + PAYLOAD[:length]
        octets += (frame + value if order == "after" else value + frame) + tag(9) + bytes(8)
        offset += 4 + length
    length = None if undone is None else 24
    return a.file(a.data_last(frames, octets, id_bytes=id_bytes, length=length), undone=undone)


def elsewhere(deflate: bool) -> bytes:
    """Payloads of variable length in a block of their own."""
    a = Assembly()
    values = b"".join(struct.pack("<L", r[13]) + PAYLOAD[: r[13]] for r in RECORDS)
    sd = a.dz(values, of=b"SD") if deflate else a.put("##SD", [], values)
    offsets = [0, 12, 18]
    data = b"".join(r[:14] + struct.pack("<Q", o) for r, o in zip(RECORDS, offsets, strict=True))
    channels = data_frame(a, payload={"bits": 64, "kind": VLSD, "data": sd})
    return a.file(a.data_group(a.group(channels, 3, 22), a.put("##DT", [], data)))


@pytest.mark.parametrize(
    ("octets", "remark"),
    [
        (plain(), ""), (lists(5, 0, False), ""), (lists(31, 0, True), ""), (lists(50, SIZE, True), ""),
        *((unsorted(n, order=order), "") for n in (1, 2, 4, 8) for order in ("after", "before")),
        (unsorted(undone=5), "is unfinished"), (elsewhere(False), ""), (elsewhere(True), ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("slice_bytes", [1 << 22, 9])
def test_the_same_frames_however_they_are_laid_down(read, monkeypatch, octets, remark, slice_bytes):
    monkeypatch.setattr(mf4_data, "SLICE_BYTES", slice_bytes)
    piece, found = read(octets)
    assert told(piece) == THREE
    assert [r.split(":")[0] for r in found.remarks] == ([remark] if remark else [])
    assert not +found.omitted and found.passed.keys() <= {"records of other channels"}


@pytest.mark.parametrize(
    "octets", [plain(), lists(31, 0, True), lists(50, SIZE, True), elsewhere(False), unsorted()]
)
def test_asammdf_reads_what_is_made_by_hand_the_same(tmp_path, octets):
    peer("asammdf")
    path = tmp_path / "a.mf4"
    path.write_bytes(octets)
    theirs = of_python_can(can.MF4Reader(path))
    few = octets == unsorted()  # asammdf 8.8 loses the last one of unsorted records
    assert theirs == THREE[: 2 if few else 3]


def test_times_may_be_integers_with_a_factor(read):
    a = Assembly()
    ns = b"".join(struct.pack("<Q", round(struct.unpack("<d", r[:8])[0] * 1e9)) + r[8:] for r in RECORDS)
    channels = data_frame(a, payload={"bits": 64}, type=UNSIGNED, conversion=a.linear(0, 1e-9))
    assert told(read(a.file(a.data_group(a.group(channels, 3, SIZE), a.put("##DT", [], ns))))[0]) == THREE


def test_start_in_local_time(read, monkeypatch):
    import time

    monkeypatch.setenv("TZ", "UTC-3")
    time.tzset()
    a = Assembly()
    piece, _ = read(a.file(fixed(a, a.put("##DT", [], RECORDS[0]), 1), flags=1))
    monkeypatch.undo()
    time.tzset()
    assert told(piece)[0][0] == 100_000 - 3 * 3600 * 10**6


def test_a_payload_of_variable_length_up_to_a_most(read):
    """MLSD: room for the longest, and a channel that says how much of it is used."""
    a = Assembly()
    channels = data_frame(a, payload={"bits": 512, "kind": MLSD})
    data = b"".join(r[:14] + PAYLOAD + bytes(56) for r in RECORDS)
    long = record(0.3, 0x55, 12, bytes(64))
    piece, found = read(a.file(a.data_group(a.group(channels, 4, 78), a.put("##DT", [], data + long))))
    assert told(piece) == THREE and dict(+found.omitted) == {FD: 1}


def test_directions_may_be_letters(read):
    a = Assembly()
    direction = {"name": "CAN_DataFrame.Dir", "byte": 22, "bits": 24, "type": 6}
    channels = data_frame(a, payload={"bits": 64}, extra=(direction,))
    data = b"".join(r + d for r, d in zip(RECORDS, (b"Tx\0", b"Rx\0", b"Tx\0"), strict=True))
    piece, _ = read(a.file(a.data_group(a.group(channels, 3, SIZE + 3), a.put("##DT", [], data))))
    assert piece.sent.tolist() == [True, False, True]


def test_what_is_marked_invalid_is_left_out(read):
    a = Assembly()
    channels = data_frame(
        a, payload={"bits": 64, "invalid": 3},
        extra=({"name": "CAN_DataFrame.Dir", "byte": 22, "bits": 8, "invalid": 9},),
    )  # fmt: skip
    marks = (b"\0\2", b"\x08\0", b"\0\0")
    data = b"".join(r + b"\1" + mark for r, mark in zip(RECORDS, marks, strict=True))
    group = a.group(channels, 3, SIZE + 1, invalid_bytes=2)
    piece, found = read(a.file(a.data_group(group, a.put("##DT", [], data))))
    assert told(piece) == [THREE[0], (*THREE[2][:3], True)] and dict(+found.omitted) == {INVALID: 1}


def test_groups_of_all_kinds_come_in_one_time_line(read):
    """Data frames of two groups, remote frames, error frames whose payload is a number (Kvaser), CAN FD."""
    a = Assembly()
    third = fixed(a, a.put("##DT", [], RECORDS[2]), 1)

    def small(kind, size, octets, following, *members):
        parts = a.channels(*({"name": f"{kind}.{n}", "byte": b, "bits": w} for n, b, w in members))
        frame = {"name": kind, "byte": 8, "bits": 8, "type": BYTES, "parts": parts}
        channels = a.channels(TIME, frame)
        group = a.group(channels, len(octets) // size, size)
        return a.data_group(group, a.put("##DT", [], octets), following=following)

    errors = small("CAN_ErrorFrame", 17, struct.pack("<dBLL", 0.15, 4, 1 << 24, 3), third,
                   ("DataLength", 8, 8), ("DataBytes", 9, 32), ("BusChannel", 13, 32))  # fmt: skip
    remote = small(
        "CAN_RemoteFrame", 13, struct.pack("<dLB", 0.12, 0x321, 5), errors, ("ID", 8, 11), ("DLC", 12, 8)
    )
    fd = small("CAN_DataFrame", 22, struct.pack("<dLBB8s", 0.11, 0x77, 8, 1, PAYLOAD), remote,
               ("ID", 8, 32), ("DLC", 12, 8), ("EDL", 13, 1), ("DataBytes", 14, 64))  # fmt: skip
    first = a.data_group(a.group(data_frame(a, payload={"bits": 64}), 2, SIZE),
                         a.put("##DT", [], b"".join(RECORDS[:2])), following=fd)  # fmt: skip
    piece, found = read(a.file(first))
    assert told(piece) == [
        THREE[0], (120_000, "can0", f"{0x321 | RTR_FLAG:X}#0000000000", False),
        (150_000, "can3", "20000000#00000001", False), *THREE[1:],
    ]  # fmt: skip
    assert dict(+found.omitted) == {FD: 1}


def test_what_is_cut_short_is_told(read):
    whole = plain()
    at = whole.index(RECORDS[2])
    piece, found = read(whole[: at + 5])
    assert told(piece) == THREE[:2]
    assert "is missing 17 bytes" in found.remarks[0] and "has 2 of 3 records" in found.remarks[1]
    a = Assembly()
    piece, found = read(a.file(fixed(a, a.put("##DT", [], b"".join(RECORDS)), 5)))
    assert told(piece) == THREE and found.remarks == ["is cut short: CAN_DataFrame has 3 of 5 records"]
    a = Assembly()
    piece, found = read(a.file(fixed(a, a.put("##DT", [], b"".join(RECORDS)), 2)))
    assert told(piece) == THREE[:2]
    assert found.remarks == ["has more data of CAN_DataFrame than its 2 records, which are not read"]
    a = Assembly()
    piece, found = read(a.file(fixed(a, a.put("##DT", [], RECORDS[0] + record(0.2, 1, 9, PAYLOAD)[:22]), 2)))
    assert dict(+found.omitted) == {FD: 1}
    shorter = elsewhere(False).replace(struct.pack("<L", 2) + PAYLOAD[:2], struct.pack("<L", 1) + PAYLOAD[:2])
    assert dict(+read(shorter)[1].omitted) == {CUT: 1}


def test_other_channels_are_counted_and_a_file_without_frames_is_told(read):
    a = Assembly()
    time = a.channels(TIME)
    piece, found = read(a.file(a.data_group(a.group(time, 12, 8), a.put("##DT", [], bytes(96)))))
    assert piece is None and found.passed == {"records of other channels": 12}
    assert found.remarks == ["has no bus logging of CAN: no channel CAN_DataFrame"]


def broken(change) -> bytes:
    """A file with something wrong in it; `change` is given its assembly and returns the data's place."""
    a = Assembly()
    return a.file(fixed(a, change(a), 6))


def ring(a: Assembly) -> int:
    at = a.put("##DL", [0, 0], struct.pack("<B3xL", 0, 1))
    a.patch(at + 24, at)
    return at


def twice(a: Assembly) -> int:
    dt = a.put("##DT", [], b"".join(RECORDS))
    return a.put("##DL", [0, dt, dt], struct.pack("<B3xL", 0, 2))


def rubbish(a: Assembly) -> int:
    return a.put("##DZ", [], struct.pack("<2s2BL2Q", b"DT", 0, 0, 0, 9, 4) + b"rubb")


def channel_ring() -> bytes:
    a = Assembly()
    channels = data_frame(a, payload={"bits": 64})
    frame = int.from_bytes(a.octets[channels - 168 + 24 : channels - 168 + 32], "little")
    a.patch(frame + 24, channels)
    return a.file(a.data_group(a.group(channels, 3, SIZE), 0))


def outside() -> bytes:
    a = Assembly()
    return a.file(a.data_group(a.group(data_frame(a, payload={"bits": 640}), 3, SIZE), 0))


@pytest.mark.parametrize(
    ("octets", "says"),
    [
        (b"", "not ASAM MDF 4: begins with nothing"),
        (b"MDX" + bytes(100), "not ASAM MDF 4: begins with 4d 44 58"),
        (Assembly().file(0, version=330), "is MDF 3.30; 4.00 and newer are read"),
        (Assembly().file(12345), "a link to byte 12345, of 168, where ##DG has to be"),
        (Assembly().file(64), "'##HD' at byte 64, where ##DG has to be"),
        (broken(lambda a: a.text("x")), "'##TX' at byte .*, where ##DT or"),
        (broken(ring), "##DL at byte 168 is linked to twice"),
        (broken(twice), "##DT at byte 168 is linked to twice"),
        (channel_ring(), "##CN at byte .* is linked to twice"),
        (outside(), "DataBytes at byte .* does not lie in"),
        (broken(lambda a: a.dz(b"".join(RECORDS), length=10)), "##DZ at byte 168 amounts to more bytes"),
        (broken(lambda a: a.dz(b"".join(RECORDS), length=100)), "##DZ at byte 168 amounts to 66 bytes"),
        (broken(lambda a: a.dz(RECORDS[0], length=1 << 40)), "at most 512 MiB are read"),
        (broken(rubbish), "##DZ at byte 168: "),
        (broken(lambda a: a.put("##DV", [], bytes(66))), "has data by columns .##DV., which are not read"),
        (unsorted().replace(b"\7\2\0\0\0", b"\5\2\0\0\0"), "a record of identifier 5, which no group has"),
        (unsorted().replace(b"\7\2\0\0\0", b"\7\2\0\0\xff"), "a value of 4278190082 bytes among the records"),
        (unsorted(undone=0x45), "is unfinished: where the data of frames are is not in it"),
        (plain().replace(struct.pack("<d", 0.2), struct.pack("<d", float("nan"))), "a frame at nan s"),
        (plain().replace(struct.pack("<d", 0.2), struct.pack("<d", 1e300)), "a frame at .*e.* s"),
    ],
)  # fmt: skip
def test_damaged_files_are_refused_in_one_line(read, octets, says):
    with pytest.raises(LogError, match=says) as caught:
        read(octets)
    assert "\n" not in str(caught.value) and "a.mf4" in str(caught.value)


def test_payloads_far_apart_are_not_held(read, monkeypatch):
    monkeypatch.setattr(variable, "MOST_HELD", 10)
    with pytest.raises(LogError, match="data of frames are more than 0 MiB apart"):
        read(elsewhere(False))


SOUND = [lists(31, 0, True), lists(5, 0, False), unsorted(), unsorted(undone=5), elsewhere(False), plain()]


@given(
    st.sampled_from(SOUND),
    st.lists(st.tuples(st.integers(0, 4000), st.sampled_from([0, 1, 255, 0x23, 8, 64])), max_size=9),
    st.integers(100, 4000),
)
@settings(max_examples=500, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_mutated_files_end_in_frames_or_in_one_line(tmp_path, whole, changes, length):
    octets = bytearray(whole)
    for at, value in changes:
        octets[at % len(octets)] = value
    path, found = tmp_path / "a.mf4", Findings()
    path.write_bytes(octets[:length])
    try:
        pieces = list(reader.read(path, found))
    except LogError as error:
        assert "\n" not in str(error)
        return
    assert sum(len(piece.frames) for piece in pieces) <= 200
    assert all("\n" not in remark for remark in found.remarks)
    assert np.isfinite(found.share or 0)
