"""The log's text against python-can's reader and writer, and against itself."""

from __future__ import annotations

import io

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, FrameBatch, batch, concat
from gnss_hil.tools.recording.formats.candump import (
    CandumpWriter,
    format_lines,
    parse_lines,
    read,
    read_chunks,
)
from gnss_hil.tools.recording.formats.piece import FD, XL, Findings, LogError

START_US = 1_351_642_484_000_000


@st.composite
def frames(draw, regular: bool) -> FrameBatch:
    """Frames as a bus may carry them; `regular` ones are base frames of eight bytes."""
    rows = []
    for _ in range(draw(st.integers(1, 12))):
        kind = 0 if regular else draw(st.sampled_from([0, EFF_FLAG, RTR_FLAG, EFF_FLAG | RTR_FLAG, ERR_FLAG]))
        top = 0x1FFF_FFFF if kind & (EFF_FLAG | ERR_FLAG) else 0x7FF
        data = draw(st.binary(min_size=8 if regular else 0, max_size=8))
        row = batch([draw(st.integers(0, top)) | kind], data, length=len(data))
        if kind & RTR_FLAG:
            row = FrameBatch(row.t_ns, row.can_id, row.length, np.zeros((1, 8), np.uint8))
        rows.append(row)
    return concat(rows)


def stamps(n: int) -> np.ndarray:
    return START_US + 111 * np.arange(n)


@given(frames(regular=True), st.sampled_from(["can0", "vcan1", "c"]))
def test_regular_frames_come_back(sent, bus):
    unix_us, names, heard, _ = parse_lines(format_lines(stamps(len(sent)), sent, bus))
    assert heard == sent
    assert (unix_us == stamps(len(sent))).all()
    assert set(names.tolist()) == {bus.encode()}


@given(frames(regular=False))
def test_irregular_frames_come_back(sent):
    _, _, heard, _ = parse_lines(format_lines(stamps(len(sent)), sent, "can0"))
    assert (heard.can_id == sent.can_id).all()
    assert (heard.length == sent.length).all()
    assert (heard.data == sent.data).all()


@given(frames(regular=False))
def test_python_can_reads_the_same_frames(sent):
    text = format_lines(stamps(len(sent)), sent, "can0").decode()
    told = list(can.CanutilsLogReader(io.StringIO(text)))
    for row, message in enumerate(told):
        can_id = int(sent.can_id[row])
        assert message.timestamp == pytest.approx(stamps(len(sent))[row] * 1e-6, abs=5e-7)
        if can_id & ERR_FLAG:
            continue  # python-can knows error frames by one class of several
        assert message.channel == "can0"
        assert message.is_extended_id == bool(can_id & EFF_FLAG)
        assert message.is_remote_frame == bool(can_id & RTR_FLAG)
        assert message.arbitration_id == can_id & 0x1FFF_FFFF
        if not message.is_remote_frame:
            assert bytes(message.data) == sent.data[row, : sent.length[row]].tobytes()
    assert len(told) == len(sent)


def test_the_format_is_candumps():
    """Example of the candump manual's log format: (seconds.microseconds) interface id#data."""
    sent = batch([0x100], bytes.fromhex("0011223344556677"))
    line = format_lines(np.array([1_351_642_500_000_000]), sent, "can0")
    assert line == b"(1351642500.000000) can0 100#0011223344556677\n"


@pytest.mark.parametrize(
    "line",
    [
        b"(1351642500.000000) can0 100#00112233445566ZZ",
        b"[1351642500.000000) can0 100#0011223344556677",
        b"(13516425x0.000000) can0 100#0011223344556677",
        b"(1351642500.000000) can0 1G0#0011223344556677",
        b"(1351642500.000000) can0 100+0011223344556677",
        b"hello",
        b"",
    ],
)
def test_a_line_that_is_none_is_named(line):
    good = format_lines(stamps(3), batch([1, 2, 3], b"12345678"), "can0")
    with pytest.raises(LogError, match=r"bus\.log: line 4: not a candump line"):
        parse_lines(good + line + b"\n", "bus.log")


@pytest.mark.parametrize("chunk_bytes", [1, 50, 97, 1 << 20])
def test_pieces_of_any_size_give_the_same_frames(chunk_bytes):
    sent = batch(np.arange(7), np.arange(56).reshape(7, 8))
    text = format_lines(stamps(7), sent, "can0")
    cut = io.BytesIO(text + b"(1351642500.0000")  # a last line that the crash cut short
    heard = concat([frames for _, _, frames, _ in read_chunks(cut, "bus.log", chunk_bytes)])
    assert heard == sent


def test_lines_as_other_programs_leave_them(tmp_path):
    """CR LF, a byte order mark, blanks behind lines, empty lines, directions, nanoseconds, length codes."""
    log, found = tmp_path / "a.log", Findings()
    log.write_bytes(
        b"\xef\xbb\xbf(1.000000) can0 101#0102030405060708\r\n"
        b"(1.000001) can0 102#0102030405060708 R\r\n(1.000002) can0 103#0102030405060708 T\r\n"
        b"\r\n(1.000003) can0 104#0102030405060708_B \t\r\n(1.000003600) can0 105#R8_9\r\n"
        b"(1.000004) can0 00333#81:00:12345678#1122334455\r\n"
        b"(1.000005) can0 106##1AABB T\r\n(1.000006) can0 12345678#01 T\r\n\x1a"
    )
    (piece,) = read(log, found)
    assert piece.frames.can_id.tolist() == [
        0x101, 0x102, 0x103, 0x104, 0x105 | RTR_FLAG, 0x12345678 | EFF_FLAG,
    ]  # fmt: skip
    assert piece.unix_us.tolist() == [1_000_000, 1_000_001, 1_000_002, 1_000_003, 1_000_004, 1_000_006]
    assert piece.sent.tolist() == [False, False, True, False, False, True]
    assert piece.frames.length.tolist() == [8, 8, 8, 8, 8, 1]
    assert dict(+found.omitted) == {FD: 1, XL: 1}


@pytest.mark.parametrize(
    "line", [b"123#01_B", b"123#R4_B", b"123#0102030405060708_8", b"123#0102030405060708 X"]
)
def test_codes_and_marks_that_cannot_be(line):
    with pytest.raises(LogError, match="not a candump line"):
        parse_lines(b"(1.000000) can0 " + line + b"\n")


def test_directions_of_whole_logs(tmp_path):
    """candump -x marks every line; what comes back has a mark behind what was sent."""
    sent = np.arange(500) % 3 == 0
    text = format_lines(stamps(500), batch(np.arange(500), b"12345678"), "can0").splitlines()
    log = b"".join(line + (b" T" if tx else b" R") + b"\n" for line, tx in zip(text, sent, strict=True))
    piece = parse_lines(log)
    assert piece.sent.tolist() == sent.tolist() and piece.unix_us.tolist() == stamps(500).tolist()
    writer = CandumpWriter(tmp_path / "out.log", {})
    writer.write(piece)
    writer.close()
    assert (tmp_path / "out.log").read_bytes() == log.replace(b" R\n", b"\n")


def _read(path, raw):
    path.write_bytes(raw)
    found = Findings()
    return concat([piece.frames for piece in read(path, found)]), found


def test_blanks_comments_and_marks_of_joined_files_are_no_part_of_a_log(tmp_path):
    text = b"(1351642484.000111) can0 101#8A000304050607FF\n(1351642484.000112) can1 18FEF100#0102 T\n"
    whole, _ = _read(tmp_path / "a.log", text + text)
    for odd in (
        b"# of a bench\n" + text + b"  # on\n\xef\xbb\xbf" + text,
        text.replace(b" ", b"\t") + text.replace(b" ", b"   "),
        b"  " + text.replace(b"\n", b"\t\r\n  ") + text,
    ):
        heard, found = _read(tmp_path / "a.log", odd)
        assert heard == whole
        assert not found.omitted


def test_a_last_line_without_an_end_counts_where_no_byte_can_be_missing(tmp_path):
    line = b"(1351642484.000111) can0 101#8A000304050607FF"
    for rest, frames, cut in ((line, 2, 0), (line + b" T", 2, 0), (line[:-2], 1, 1), (line[:-1], 1, 1)):
        heard, found = _read(tmp_path / "a.log", line + b"\n" + rest)
        assert (len(heard), found.omitted["cut short"]) == (frames, cut)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ("(1.000000) can0 101#00\n".encode("utf-16"), "is UTF-16 text; save it as UTF-8"),
        (b"(1.000000) can0 101#00\r(1.000001) can0 101#00\r", "lines end in CR alone"),
    ],
)
def test_text_that_is_not_read_is_named(tmp_path, raw, words):
    with pytest.raises(LogError, match=words):
        _read(tmp_path / "a.log", raw)


def test_a_line_without_an_end_is_refused():
    with pytest.raises(LogError, match=r"a\.log: not a candump log: line 1 has no end"):
        list(read_chunks(io.BytesIO(bytes(1 << 18)), "a.log", 1 << 12))
