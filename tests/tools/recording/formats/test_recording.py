"""Recordings in every format: round trips, other programs' readers, damaged files."""

from __future__ import annotations

import logging
import random
import subprocess
from collections import Counter
from datetime import datetime
from importlib import resources
from pathlib import Path

import can
import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, ERR_FLAG, RTR_FLAG, batch, concat
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.formats.candump import format_lines
from gnss_hil.tools.recording.formats.convert import convert
from gnss_hil.tools.recording.formats.order import HOLD_US, LATE, in_time_order
from gnss_hil.tools.recording.formats.piece import LogError, Piece
from gnss_hil.tools.recording.formats.recording import FORMATS, Channels, Recording
from tests.support.outside import can_utils, peer
from tests.support.waiting import HANG_S

pytestmark = pytest.mark.verifies(
    "tools/recording/formats/recording.py",
    "tools/recording/formats/asc/writer.py",
    "tools/recording/formats/convert.py",
    "tools/recording/formats/order.py",
    "tools/recording/formats/piece.py",
    what="Recordings: ASC, BLF, MF4",
    by=(
        "byte-identical round trips; asc2log, log2asc, python-can; asammdf with the DBC for MF4; vblf 0.3.1 "
        "once by hand for BLF. SavvyCAN was not tried"
    ),
    status="validated",
)

OTHERS = [suffix for suffix in FORMATS if suffix != ".log"]
START_US = 1_351_642_484_000_000
ODD_US = 1_351_642_484_005_003  # a start that is no whole second nor millisecond


@pytest.fixture(scope="module")
def run_log(tmp_path_factory) -> Path:
    """A run's log: thousands of frames, some of them measurements."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    assert main(["run", "--bus", "inline", "--duration", "45", "--out", str(folder), "--quiet"]) == 0
    return folder / "bus.log"


def written(path: Path, *lines: tuple[int, str, str]) -> Path:
    """A candump log of (time [us], bus, frame)."""
    path.write_text("".join(f"({t // 10**6}.{t % 10**6:06d}) {bus} {frame}\n" for t, bus, frame in lines))
    return path


def there_and_back(log: Path, suffix: str) -> bytes:
    other, back = log.with_suffix(suffix), log.with_name("back.log")
    convert(Recording(log), other)
    convert(Recording(other), back)
    return back.read_bytes()


def ranges_of(log: Path) -> np.ndarray:
    """Pseudoranges [m] by the project's own codec."""
    ((_, _, frames, _),) = Recording(log).pieces()
    contract = codec(4)
    mine = contract.kind_of[frames.can_id] == contract.kinds["RANGE"].number
    return contract.decode("RANGE", frames.data[mine])["pseudorange_m"]


@pytest.mark.parametrize("suffix", OTHERS)
def test_a_run_comes_back_byte_for_byte(run_log, suffix):
    assert there_and_back(run_log, suffix) == run_log.read_bytes()


@pytest.mark.parametrize("suffix", OTHERS)
def test_frames_of_every_kind_come_back(tmp_path, suffix):
    log = written(
        tmp_path / "odd.log",
        (ODD_US, "can0", "123#"),
        (ODD_US + 1, "can1", "7FF#0011223344556677"),
        (ODD_US + 999, "can0", "18FEF1AA#01"),
        (ODD_US + 1000, "can0", "00000001#AABB"),
        (ODD_US + 10**6 - 4, "can2", "123#R0"),
        (ODD_US + 10**6, "can2", "1FFFFFFF#R8"),
    )
    assert there_and_back(log, suffix) == log.read_bytes()


@pytest.mark.parametrize("suffix", OTHERS)
def test_an_error_frame_comes_back_as_far_as_the_format_goes(tmp_path, suffix):
    log = written(tmp_path / "error.log", (ODD_US, "can0", "20000080#0001020304050607"))
    expected = log.read_bytes()
    if suffix == ".asc":
        expected = expected.replace(b"20000080#0001020304050607", b"20000000#")
    assert there_and_back(log, suffix) == expected


@pytest.mark.parametrize("suffix", OTHERS)
def test_an_empty_recording_is_one(tmp_path, suffix):
    assert there_and_back(written(tmp_path / "empty.log"), suffix) == b""


@pytest.mark.parametrize("suffix", OTHERS)
def test_two_buses_get_one_time_line(tmp_path, suffix):
    """A run's log tells an epoch of one craft after the other; each craft's frames must stay as they are."""
    lines = [(START_US + 10**6 * epoch + 111 * i, f"can{bus}", f"10{bus}#{i:02X}{epoch:02X}")
             for epoch in range(30) for bus in range(2) for i in range(20)]  # fmt: skip
    log = written(tmp_path / "two.log", *lines)
    back = there_and_back(log, suffix).splitlines()
    assert back == sorted(log.read_bytes().splitlines(), key=lambda line: line[:19])
    for bus in (b" can0 ", b" can1 "):
        assert [x for x in back if bus in x] == [x for x in log.read_bytes().splitlines() if bus in x]


@pytest.mark.parametrize("suffix", OTHERS)
@pytest.mark.parametrize("buses", [1, 2])
def test_a_leap_second_keeps_its_order(tmp_path, suffix, buses):
    """The end of 2016: a second of UNIX time comes twice, and frames stay in the order of the bus."""
    epochs = [gpstime.from_utc(datetime(2017, 1, 1)) + k * gpstime.NS_PER_S for k in range(-4, 4)]
    lines = [(gpstime.to_unix_ns(t) // 1000 + 111 * i, f"can{bus}", f"10{bus}#{k:02X}{i:02X}")
             for k, t in enumerate(epochs) for bus in range(buses) for i in range(20)]  # fmt: skip
    assert sorted(t for t, *_ in lines) != [t for t, *_ in lines]
    log = written(tmp_path / "leap.log", *lines)
    back = there_and_back(log, suffix).splitlines()
    wanted = log.read_bytes().splitlines()
    for bus in range(buses):
        assert [x for x in back if b" can%d " % bus in x] == [x for x in wanted if b" can%d " % bus in x]
    assert [line.split(b"#")[1][:2] for line in back] == sorted(line.split(b"#")[1][:2] for line in wanted)


def test_frames_that_come_far_too_late_are_told():
    def piece(*stamps):
        n = len(stamps)
        return Piece(
            np.array(stamps), np.full(n, b"can0", "S15"), batch(np.full(n, 1), b"\1"), np.zeros(n, bool)
        )

    strayed = Counter()
    pieces = [piece(0, 5, 2), piece(3 * HOLD_US), piece(1, 3 * HOLD_US + 1)]
    told = np.concatenate([p[0] for p in in_time_order(pieces, strayed)])
    assert told.tolist() == [0, 2, 5, 1, 3 * HOLD_US, 3 * HOLD_US + 1]
    assert strayed == {LATE: 1}


def test_names_of_buses_become_numbers():
    channels = Channels()
    assert [channels[name] for name in (b"vcan1", b"can1", b"slcan", b"can7", b"vcan1")] == [1, 0, 2, 7, 1]
    assert channels.renamed == {"vcan1": "can1", "can1": "can0", "slcan": "can2"}


def test_can_utils_read_our_asc(run_log, tmp_path):
    can_utils("asc2log")
    asc = tmp_path / "bus.asc"
    convert(Recording(run_log), asc)
    told = subprocess.run(["asc2log", "-I", str(asc)], capture_output=True, check=True, timeout=HANG_S).stdout
    theirs = [line.split() for line in told.decode().splitlines()]
    ours = [line.split() for line in run_log.read_text().splitlines()]
    assert [words[1:3] for words in theirs] == [words[1:3] for words in ours]
    # asc2log may not understand the date; then it counts from now. Distances must be exact all the same.
    us = [np.array([int(w[0][1:-1].replace(".", "")) for w in rows]) for rows in (theirs, ours)]
    assert (np.diff(us[0]) == np.diff(us[1])).all()


@pytest.mark.parametrize("options", [[], ["-n"], ["-f"], ["-f", "-n"]])
def test_we_read_the_asc_of_can_utils(run_log, tmp_path, options):
    """Lines ending in CR LF, and classical frames as events of CAN FD, too."""
    can_utils("log2asc")
    asc, back = tmp_path / "bus.asc", tmp_path / "back.log"
    words = ["log2asc", *options, "-I", str(run_log), "-O", str(asc), "can0"]
    subprocess.run(words, check=True, timeout=HANG_S)
    convert(Recording(asc), back)
    assert back.read_bytes() == run_log.read_bytes()


def test_python_can_reads_our_asc_and_dates_it_right(tmp_path):
    asc = tmp_path / "one.asc"
    convert(Recording(written(tmp_path / "one.log", (ODD_US, "can0", "123#0102"))), asc)
    (message,) = can.ASCReader(asc, relative_timestamp=False)
    assert round(message.timestamp * 1e6) == ODD_US
    assert (message.arbitration_id, bytes(message.data), message.channel) == (0x123, b"\1\2", 0)
    assert asc.read_text().splitlines()[0].startswith("date Wed Oct 31 ")  # not the day of writing


def test_asammdf_decodes_our_mf4_with_the_dbc(run_log, tmp_path):
    asammdf = peer("asammdf")
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    path = tmp_path / "bus.mf4"
    convert(Recording(run_log), path)
    dbc = resources.files("gnss_hil.dbc.contract") / "gnss.dbc"
    with asammdf.MDF(path) as measured:
        decoded = measured.extract_bus_logging(database_files={"CAN": [(str(dbc), 0)]})
        epochs = decoded.get("TIME_MARK.epoch").samples
        ranges = np.concatenate(
            [decoded.get("pseudorange_m", *at).samples for at in decoded.whereis("pseudorange_m")]
        )
        assert measured.header.start_time.timestamp() == int(run_log.read_text()[1:11])
    assert epochs.tolist() == list(range(45))
    assert np.allclose(np.sort(ranges), np.sort(ranges_of(run_log)), rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", ["e.asc", "e.log", "e.parquet"])
def test_a_recording_without_a_frame_is_told_and_no_success(tmp_path, name, capsys):
    source, out = tmp_path / "empty.log", tmp_path / name
    source.touch()
    assert main(["convert", str(source), str(out)]) == 1
    assert capsys.readouterr().err == f"gnss-hil: {source}: holds no frames\n"
    assert out.is_file()


@pytest.mark.parametrize("suffix", FORMATS)
def test_fd_frames_are_counted_and_left_out(tmp_path, suffix, capsys):
    source = tmp_path / f"fd{suffix}"
    if suffix == ".log":
        source.write_text("(1351642484.000000) can0 123##1AABB\n(1351642484.000111) can0 123#01\n")
    else:
        with can.Logger(source) as logger:
            for fd in (True, False):
                logger(can.Message(1351642484, 0x123, is_extended_id=False, is_fd=fd, data=[1], channel=0))
    assert main(["convert", str(source), str(tmp_path / "out.log")]) == 1, "a frame is not in the new file"
    assert capsys.readouterr().err == f"gnss-hil: {source}: frames left out: 1 CAN FD\n"
    assert (tmp_path / "out.log").read_text().endswith(" can0 123#01\n")


@pytest.mark.parametrize("suffix", FORMATS)
def test_damaged_files_get_a_line_and_leave_nothing(run_log, tmp_path, suffix, capsys):
    """Rubbish, whole files with octets changed or cut: an answer or one line, and no half-written file."""
    sound, damaged, out = (tmp_path / f"{name}{suffix}" for name in ("sound", "damaged", "out"))
    out = out.with_suffix(".asc" if suffix == ".log" else ".log")
    log = written(tmp_path / "few.log", *((START_US + i, "can0", f"1{i:02X}#0102") for i in range(50)))
    convert(Recording(log), sound)
    rng = random.Random(5)
    whole = sound.read_bytes()
    cases = [b"", rng.randbytes(2000), whole[: len(whole) // 2], whole[:-1], whole[:200]]
    for _ in range(15):
        octets = bytearray(whole)
        for _ in range(8):
            octets[rng.randrange(len(octets))] = rng.randrange(256)
        cases.append(bytes(octets))
    answers = Counter()
    for case in cases:
        damaged.write_bytes(case)
        status = main(["convert", str(damaged), str(out), "--force"])
        said = capsys.readouterr().err
        assert status in (0, 1, 2), said
        assert status < 2 or (said.count("\n") == 1 and str(damaged) in said), said
        assert "internal error" not in said and "Traceback" not in said
        answers[status] += 1
        assert out.exists() == (status < 2)
        assert (status == 1) == any(word in said for word in ("cut short", "left out", "holds no frames")), (
            said
        )
        out.unlink(missing_ok=True)
    assert answers[2] >= 1
    assert {p.name for p in tmp_path.iterdir()} == {"few.log", sound.name, damaged.name}


def test_what_a_cut_takes_is_in_the_exit_status(run_log, tmp_path, capsys):
    """Both of a log and of its signals: what is there is written, and a script hears that it is not all."""
    cut = tmp_path / "cut.log"
    cut.write_bytes(run_log.read_bytes()[:-60])
    for out in (tmp_path / "out.asc", tmp_path / "out.parquet"):
        assert main(["convert", str(run_log), str(out)]) == 0
        assert main(["convert", str(cut), str(out), "--force"]) == 1
        assert capsys.readouterr().err == f"gnss-hil: {cut}: frames left out: 1 cut short\n"
        assert out.exists()


def test_a_cut_asc_tells_no_frame_of_its_last_line(tmp_path):
    asc = tmp_path / "cut.asc"
    convert(
        Recording(written(tmp_path / "a.log", (ODD_US, "can0", "123#AB"), (ODD_US, "can0", "124#CD"))), asc
    )
    asc.write_bytes(asc.read_bytes().split(b"CD")[0] + b"C")
    recording = Recording(asc)
    assert sum(len(piece[0]) for piece in recording.pieces()) == 1
    assert "cut short" in recording.found.remarks[0]


def test_what_cannot_be_converted_is_told_before_anything_is_written(tmp_path, capsys):
    log = written(tmp_path / "a.log", (ODD_US, "can0", "123#AB"))
    taken = tmp_path / "taken.asc"
    taken.write_text("mine")
    for words, told in (
        ([log, tmp_path / "a.csv"], "suffix '.csv' is no recording; allowed are .log, .asc, .blf, .mf4"),
        ([tmp_path / "none.log", taken], "no such run folder or recording"),
        ([log, taken], "exists; --force overwrites it"),
        ([log, log], "is what would be read"),
        ([log, tmp_path / "no" / "a.asc"], "no such folder"),
    ):
        assert main(["convert", *map(str, words)]) == 2
        said = capsys.readouterr().err
        assert told in said and said.count("\n") == 1
    assert taken.read_text() == "mine"
    with pytest.raises(Mistake):
        Recording(tmp_path)


def test_remote_extended_and_long_names_in_a_log(tmp_path):
    """An extended frame of a bus with a short name has a line as long as a base frame of a longer one."""
    frames = concat(
        [batch([1 | EFF_FLAG], bytes(8)), batch([2 | RTR_FLAG], b""), batch([3 | ERR_FLAG], bytes(8))]
    )
    log = tmp_path / "names.log"
    stamps = ODD_US + np.arange(3)
    log.write_bytes(b"".join(format_lines(stamps, frames, name) for name in ("can0", "fifteen-letters")))
    ((_, bus, heard, _),) = Recording(log).pieces()
    assert heard == concat([frames, frames])
    assert bus.tolist() == [b"can0"] * 3 + [b"fifteen-letters"] * 3
    log.write_text("(1351642484.000000) can0 FFF#01\n")
    with pytest.raises(LogError, match="line 1: not a candump line"):
        list(Recording(log).pieces())
