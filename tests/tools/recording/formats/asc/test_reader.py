"""ASC as programs write it: python-can's where its reader is right; CANoe, BUSMASTER, Kvaser by hand."""

from __future__ import annotations

import random
import time
from datetime import datetime

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, FrameBatch
from gnss_hil.tools.recording.formats.asc import reader
from gnss_hil.tools.recording.formats.asc.events import UNNAMED, Frame, event, time_ns
from gnss_hil.tools.recording.formats.asc.header import date_of
from gnss_hil.tools.recording.formats.asc.lines import parse
from gnss_hil.tools.recording.formats.order import joined
from gnss_hil.tools.recording.formats.piece import BEYOND, CUT, FD, XL, Findings, LogError, Piece
from tests.support.can_messages import hexes, read_whole

pytestmark = pytest.mark.verifies(
    "tools/recording/formats/asc/reader.py",
    "tools/recording/formats/asc/lines.py",
    "tools/recording/formats/asc/events.py",
    "tools/recording/formats/asc/header.py",
    what="Vector ASC of other programs, read",
    by=(
        "python-can's reader on files of its writer; lines as CANoe 9 to 11, BUSMASTER 7.1, Kvaser's "
        "converter and log2asc write them, with what can-utils' asc2log makes of them; mutated files"
    ),
    status="validated",
)

DATE = "date Wed Oct 31 12:14:44.000 am 2012\n"
HEAD = DATE + "base hex  timestamps absolute\ninternal events logged\n// version 9.0.0\n"
START_US = 1_351_642_484_000_000
DATA = "8A 00 03 04 05 06 07 FF"


@pytest.fixture(autouse=True)
def utc(monkeypatch):
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.fixture
def read(tmp_path):
    def read(text: str | bytes) -> tuple[Piece, Findings]:
        octets = text.encode() if isinstance(text, str) else text
        return read_whole(reader.read, tmp_path / "a.asc", octets)

    return read


def elapsed(piece: Piece) -> list[int]:
    return (piece.unix_us - START_US).tolist()


def test_a_file_of_canoe(read):
    piece, found = read(
        HEAD
        + f"""Begin Triggerblock Wed Oct 31 12:14:44.000 am 2012
   0.000000 Start of measurement
   0.015991 CAN 1 Status:chip status error passive - TxErr: 132 RxErr: 0
   1.015991 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%
   2.501000 1 ErrorFrame
   2.501010 1 ErrorFrame ECC: 10100010
   2.501020 2 ErrorFrame Flags = 0xe CodeExt = 0x20a2 Code = 0x82 ID = 0 DLC = 0 Position = 5 Length = 11300
   2.520002 3 200 Tx r Length = 1704000 BitCount = 145 ID = 512
   2.584921 4 300 Tx r 8 Length = 1704000 BitCount = 145 ID = 768
   3.098426 1  18EBFF00x       Rx d 8 {DATA}    Length = 273910 BitCount = 141 ID = 418119424x
   3.297743 1  J1939TP FEE3p        6    0  0   -   Rx   d 23 A0 0F A6 60 3B D1 40 1F
   3.300000 1  6F9             Tx   d 2 05 0C  Length = 240015 BitCount = 124 ID = 1785
   3.400000 1  EngineData      Rx   d 1 7F  Length = 240015 BitCount = 124 ID = 100
   3.400001 1  NoNumber        Rx   d 1 7F
   3.500000 1  6F9             TxRq   d 2 05 0C
   3.600000 SV: 2 0 1 ::Names::Speed = 5
   3.700000 Something := 12
   3.800000 Something else
   3.900000 1  6F9             Rx   d 3 05 0C
   4.000000 1  6F9             Rx   d f {DATA}
   4.100000 1  8F9             Rx   d 1 01
//0.000000 previous log file: other.asc
End TriggerBlock
"""
    )
    assert hexes(piece) == [
        *["20000000#"] * 3, "40000200#", f"{0x300 | RTR_FLAG:X}#" + "00" * 8,
        "98EBFF00#8A000304050607FF", "6F9#050C", "64#7F", "6F9#8A000304050607FF",
    ]  # fmt: skip
    assert piece.frames.length.tolist() == [0, 0, 0, 0, 8, 8, 2, 1, 8]
    assert piece.bus.tolist() == [b"can0", b"can0", b"can1", b"can2", b"can3", *[b"can0"] * 4]
    assert piece.sent.tolist() == [False, False, False, True, True, False, True, False, False]
    assert elapsed(piece)[:3] == [2_501_000, 2_501_010, 2_501_020]
    assert dict(found.omitted) == {UNNAMED: 1, CUT: 1, BEYOND: 1}
    assert found.passed == {
        "states of controllers": 1, "statistics": 1, "J1939 transports": 1, "requests to send": 1,
        "system variables": 1, "environment variables": 1, "unknown lines": 1, "comments": 1,
    }  # fmt: skip
    assert found.remarks == ["line 22 is not known: '3.800000 Something else'"]


def test_events_of_fd_and_xl_channels(read):
    tail = "200000 e0006659 46500250 4b140250 20011736 2001040d"
    piece, found = read(
        HEAD
        + f"""   0.1 CANFD   1 Rx        101                      0 0 8  8 {DATA}   102203  133   {tail}
   0.2 CANFD   2 Tx  18EBFF00x  A_Name                            0 0 8  8 {DATA}   102203  133   {tail}
   0.3 CANFD   1 Rx        103           1 0 a 16 {DATA} {DATA} 102203  133   203000 0 0 0
   0.4 CANFD   3 Tx     50005x                                0 1 5 0 140000 73 200050 7a60 46500250 460a0250
   0.5 CANFD   5 Tx ErrorFrame Not Acknowledge error, dominant error flag fffe c7 31ca Arb. 556 44 0 0 f 64 00
   0.6 CANFD   1 Rx        104                                   0 0 8  8 {DATA}
   0.7 CANFD   1 Rx        105                                   0 0 8  8 {DATA[:-3]}
   0.8 CANFD   1 Rx        106                                   0 0 0  0 102203  133   200000 0 0
   0.9 CANXL   2 Rx   CBFF   243215   176      432  msgCanCCTest1 f 8 {DATA} 174 00000000 00000000
   1.0 CANXL   2 Rx   CEFF   243215   176      432  2 2 8A 01 174 00000000 00000000
   1.1 CANXL   2 Rx   FBFF   243215   176      432  9 12 {DATA} 11 22 33 44 a 12345 00001240 00000000
   1.2 CANXL   2 Rx   XLFF   243215   176      432  9 12 {DATA}
   1.3 CANFD   1 TxRq      101                                   0 0 8  8 {DATA}   102203  133   {tail}
"""
    )
    assert hexes(piece) == [
        "101#8A000304050607FF", "98EBFF00#8A000304050607FF", f"{0x50005 | EFF_FLAG | RTR_FLAG:X}#0000000000",
        "20000000#", "106#", "432#8A000304050607FF", "80000432#8A01",
    ]  # fmt: skip
    assert dict(found.omitted) == {FD: 4, XL: 1} and found.passed == {"requests to send": 1}
    assert piece.sent.tolist() == [False, True, True, True, False, False, False]


def test_relative_times_count_from_the_event_before_whatever_it_is(read):
    text = (
        DATE
        + "base hex  timestamps relative\ninternal events logged\n"
        + f"""Begin Triggerblock {DATE[5:]}
   0.000000 Start of measurement
   0.100000 1  101             Rx   d 1 8A
   0.100000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%
   0.100000 1  102             Rx   d 1 8A
   1.000000 1 ErrorFrame
   0.000001 1  103             Rx   d 1 8A
"""
    )
    expected = [100_000, 300_000, 1_300_000, 1_300_001]
    assert elapsed(read(text)[0]) == expected
    for size in (60, 200):  # however the file is cut into chunks
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(reader, "CHUNK_BYTES", size)
            assert elapsed(read(text)[0]) == expected


def test_numbers_may_be_decimal(read):
    piece, _ = read(
        DATE
        + "base dec  timestamps absolute\n"
        + """ 0.1 1  257  Rx   d 3 138 0 255
 0.2 1  2147x  Rx   d 1 10
 0.3 CANFD   1 Rx 257  0 0 2  2 138 07   102203  133   200000 0 0
 0.4 CANFD   1 Rx 1ab  0 0 2  2 8A 07   102203  133   200000 0 0
"""
    )
    assert hexes(piece) == ["101#8A00FF", f"{2147 | EFF_FLAG:X}#0A", "101#8A07", "1AB#8A07"]


@pytest.mark.parametrize(
    ("head", "offset_us"),
    [
        (HEAD, 0),
        (DATE.replace(".000", "") + "base hex  no internal events logged\n", 0),  # BUSMASTER
        ("date Mit Okt 31 00:14:44.000 2012\nbase hex  timestamps absolute\n", 0),
        ("base hex timestamps absolute\nBegin Triggerblock Wed Oct 31 12:14:44.000 am 2012\n", 0),
        # the first block has its own clock, as python-can writes it
        (HEAD.replace("2012", "2013") + f"Begin Triggerblock {DATE[5:]} 0.000 Start of measurement\n", 0),
        (DATE + "base hex timestamps absolute\n// CAN channel: 1 2\nBegin Triggerblock\n", 0),  # Kvaser
        # triggered later: times count from the date of the file
        (HEAD + "Begin Triggerblock Wed Oct 31 12:15:44.000 am 2012\n 0.05 log trigger event\n", 0),
        ("\ufeff" + HEAD, 0),
        (HEAD.replace("\n", "\r\n"), 0),
        # BUSMASTER's times of day
        ("date Wed Oct 31 12:14:43 am 2012\nbase hex  no internal events logged\n", -884_000_000),
    ],
)  # fmt: skip
def test_headers_of_many_programs(read, head, offset_us):
    late = -offset_us / 1e6
    piece, found = read(head + f"{late + 0.1:.6f} 1 101 Rx d 1 8A\n{late + 0.2:.9f} 1  102  Rx   d   1 8A \n")
    assert elapsed(piece) == [100_000, 200_000]
    assert found.passed.keys() <= {"comments"} and len(found.remarks) == (offset_us != 0)


def test_a_second_block_that_begins_at_zero_has_its_own_date(read):
    lines = "Begin Triggerblock Wed Oct 31 12:{}:44 am 2012\n{} log trigger event\n{} 1 101 Rx d 0\n"
    block = lines + "End TriggerBlock\n"
    own, triggered = block.format(15, "0.0", "0.5"), block.format(15, "60.0", "60.5")
    first = block.format(14, "0.0", "0.1")
    assert elapsed(read(HEAD + first + own)[0]) == [100_000, 60_500_000]
    assert elapsed(read(HEAD + first + triggered)[0]) == [100_000, 60_500_000]


@pytest.mark.parametrize(
    ("text", "at"),
    [
        ("Wed Oct 31 12:14:44.000 am 2012", "2012-10-31T00:14:44"),
        ("Wed Oct 31 12:14:44 pm 2012", "2012-10-31T12:14:44"),
        ("Thu Apr 16 01:59:01.000 pm 2020", "2020-04-16T13:59:01"),
        ("Thu Apr 16 13:59:01.123456 pm 2020", "2020-04-16T13:59:01.123456"),
        ("Sam Mär 30 15:06:13.191 2017", "2017-03-30T15:06:13.191"),
        ("sam. févr. 4 15:06:13.191 2017", "2017-02-04T15:06:13.191"),
        ("2017-09-30 15:06:13.191", "2017-09-30T15:06:13.191"),
        ("2017-09-30T15:06:13.191", "2017-09-30T15:06:13.191"),
        ("30.09.2017 15:06:13", "2017-09-30T15:06:13"),
        ("Thu Jan 1 12:00:00.0 AM 1970", "1970-01-01T00:00:00"),
        ("yesterday", None), ("Wed Oct 31 12:14:44.000 am 201²", None),
        ("Wed Oct 32 12:14:44 am 2012", None), ("Wed Oct 31 2012", None),
    ],
)  # fmt: skip
def test_dates(text, at):
    date = date_of(text)
    assert (date and date.unix_ns) == (
        at and round(datetime.fromisoformat(at + "+00:00").timestamp() * 1e6) * 1000
    )


def test_what_cannot_be_dated_is_told(read):
    assert read("base hex timestamps absolute\n0.1 1 101 Rx d 0\n")[1].remarks == [
        "has no date: times count from 1970-01-01 UTC"
    ]
    assert read("date soon\nbase hex\n0.1 1 101 Rx d 0\n")[1].remarks == ["date 'soon' is not understood"]


@pytest.mark.parametrize("head", [b"hello\n", b"", b"\xff\xfed\x00a\x00t\x00e\x00"])
def test_what_is_no_asc_is_refused(read, head):
    with pytest.raises(LogError, match=r"a\.asc: (not Vector ASC|is UTF-16)"):
        read(head + b"0.1 1 101 Rx d 0\n")


def test_tabs_are_blanks_of_a_header(read):
    piece, _ = read("base\tdec\ttimestamps relative\n0.1\t1\t101\tRx\td\t1\t17\n0.1 1 101 Rx d 1 255\n")
    assert hexes(piece) == ["65#11", "65#FF"]
    assert np.diff(piece.unix_us).tolist() == [100_000]


@pytest.mark.parametrize(
    ("line", "base", "whole"),
    [
        ("0.2 1 101 Rx d 2 11 22", "hex", True),
        ("0.2 1 101 Rx d 2 11 2", "hex", False),
        ("0.2 1 101 Rx d 2 11", "hex", False),
        ("0.2 1 101 Rx d 2 17 25", "dec", False),
        ("0.2 1 101 Rx d 2 17 25  Len", "dec", True),
        ("0.2 1 101 Rx d", "hex", False),
        ("0.2 1 101 Rx r", "hex", False),
        ("0.2 1 10", "hex", False),
    ],
)
def test_a_last_line_without_an_end_counts_where_no_byte_can_be_missing(read, line, base, whole):
    piece, found = read(HEAD.replace("hex", base) + f"0.1 1 101 Rx d 1 11\n{line}")
    assert len(piece.frames) == 1 + whole
    assert bool(found.remarks) is not whole


def test_lines_of_carriage_returns_alone_are_refused(read):
    with pytest.raises(LogError, match=r"a\.asc: lines end in CR alone"):
        read(HEAD.encode().replace(b"\n", b"\r") + b"0.1 1 101 Rx d 0\r")


def test_a_line_without_an_end_is_refused(read, monkeypatch):
    monkeypatch.setattr(reader, "CHUNK_BYTES", 4096)
    with pytest.raises(LogError, match="line 5 has no end"):
        read(HEAD + "x" * 200_000)


WORDS = st.sampled_from(
    "1 2 255 0 x 18EBFF00x 7FF 123 Rx Tx TxRq d r 8 f 2 00 FF ff 1FF 8A Length = 5 CANFD 0.5 .5 5.".split()
)


@given(
    st.lists(WORDS, min_size=1, max_size=16), st.sampled_from([" ", "  ", "\t"]), st.sampled_from([10, 16])
)
def test_lines_and_events_read_the_same(words, blank, base):
    """Whatever the fast way takes for a frame, the thorough one does; and the usual frames are taken."""
    line = ("  1.5" + blank + blank.join(words)).encode()
    fast = parse(line + b"\n", base)
    slow = event(line.decode().split(None, 1)[1], base)
    if fast.framed[0]:
        data = fast.data[0, : fast.length[0]].tobytes()
        told = Frame(int(fast.channel[0]), int(fast.can_id[0]), int(fast.length[0]), data, bool(fast.sent[0]))
        assert told == slow
        assert fast.t_ns[0] == time_ns(line) == 1_500_000_000


@pytest.mark.parametrize("stamp", ["0.1", "12.1234", "0.000000001", "123456.123456789", "  7,5"])
def test_usual_lines_go_the_fast_way(stamp):
    lines = parse(f"{stamp} 1  18EBFF00x Rx   d 3 01 02 ff  Length = 0 BitCount = 64 ID = 1x\n".encode(), 16)
    assert lines.framed.all() and lines.t_ns[0] == time_ns(stamp.encode() + b" ")
    assert (lines.can_id[0], lines.data[0, :3].tolist()) == (0x18EBFF00 | EFF_FLAG, [1, 2, 255])


def _hex(message: can.Message) -> str:
    flags = EFF_FLAG * message.is_extended_id | RTR_FLAG * message.is_remote_frame
    payload = bytes(message.dlc) if message.is_remote_frame else message.data
    return f"{message.arbitration_id | flags:X}#{payload.hex().upper()}"


def test_python_can_reads_the_same_of_its_own(tmp_path):
    """Frames of all kinds as python-can writes and reads them; its CAN FD frames are left out."""
    rng, path = random.Random(3), tmp_path / "theirs.asc"
    with can.ASCWriter(path) as writer:
        for i in range(500):
            extended, remote, sent = (rng.random() < p for p in (0.3, 0.1, 0.3))
            fd = not remote and rng.random() < 0.2
            error = rng.random() < 0.05
            data = b"" if remote else rng.randbytes(rng.randrange(9))
            writer(can.Message(
                START_US / 1e6 + i * 0.01, rng.randrange(2**29 if extended else 2**11), extended,
                remote and not error, error, rng.randrange(3), len(data), data, fd and not error, not sent,
            ))  # fmt: skip
    theirs = list(can.ASCReader(path, relative_timestamp=False))
    found = Findings()
    ours = joined(list(reader.read(path, found)))
    kept = [m for m in theirs if not m.is_fd or m.is_error_frame]
    assert found.omitted[FD] == len(theirs) - len(kept) > 50 and not found.passed
    assert np.abs(ours.unix_us / 1e6 - [m.timestamp for m in kept]).max() < 2e-6
    assert ours.bus.tolist() == [f"can{m.channel}".encode() for m in kept]
    plain = [i for i, m in enumerate(kept) if not m.is_error_frame]
    assert [hexes(ours)[i] for i in plain] == [_hex(kept[i]) for i in plain]
    assert [ours.sent[i] for i in plain] == [not kept[i].is_rx for i in plain]
    assert len(plain) < len(kept) and all(
        ours.frames.can_id[[i for i in range(len(kept)) if i not in plain]] == ERR_FLAG
    )


def test_mutated_files_end_in_frames_or_in_one_line(read):
    good = HEAD + "".join(
        f"   {0.1 * i:.6f} 1  {i:X}             Rx   d 8 {DATA}  Length = 240015 BitCount = 124 ID = {i}\n"
        f"   {0.1 * i:.6f} CANFD   1 Rx        101   0 0 8  8 {DATA}   102203  133   200000 e0006659\n"
        for i in range(20)
    )
    rng = random.Random(8)
    for _ in range(150):
        octets = bytearray(good.encode())
        for _ in range(rng.randrange(1, 30)):
            octets[rng.randrange(len(octets))] = rng.choice([rng.randrange(256), 32, 10, 48, 70])
        try:
            piece, found = read(bytes(octets))
        except LogError as error:
            assert "\n" not in str(error)
            continue
        assert isinstance(piece.frames, FrameBatch)
        assert all("\n" not in remark for remark in found.remarks)
