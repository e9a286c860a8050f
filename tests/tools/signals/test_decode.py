"""Signals of any DBC: cantools, frame by frame, is the judge of what arrays decode at once."""

from __future__ import annotations

import struct
from datetime import UTC, datetime

import cantools
import numpy as np
import polars as pl
import pytest
from cantools.database.namedsignalvalue import NamedSignalValue

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, FrameBatch, batch
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.recording.formats.piece import Piece
from gnss_hil.tools.results import parquet
from gnss_hil.tools.signals import tables
from gnss_hil.tools.signals.database import Database, load, of_text, shipped
from gnss_hil.tools.signals.decode import Undecoded
from gnss_hil.tools.signals.tables import LongTable, MessageTable

pytestmark = pytest.mark.verifies(
    "tools/signals/decode.py",
    "tools/signals/database.py",
    "tools/signals/tables.py",
    "tools/signals/write.py",
    what="Signals of any DBC as tables",
    by=(
        "cantools, every signal of random frames of this bench's contract and of a DBC with both byte "
        "orders, floating point, choices, nested multiplexers; polars reads the files"
    ),
    status="validated",
)

DBC = """VERSION ""
NS_ :
BS_:
BU_: A B
BO_ 257 Plain: 8 A
 SG_ le_u : 3|11@1+ (1,0) [0|0] "m" B
 SG_ le_s : 14|9@1- (0.25,-3) [0|0] "" B
 SG_ be_u : 31|13@0+ (2,5) [0|0] "km" B
 SG_ be_s : 34|14@0- (0.1,0) [0|0] "" B
 SG_ top : 63|4@0- (1,0) [0|0] "" B
BO_ 2566844672 Floats: 8 A
 SG_ f_le : 0|32@1- (1,0) [0|0] "" B
 SG_ f_be : 39|32@0- (0.5,1) [0|0] "V" B
BO_ 2147483905 Wide: 8 A
 SG_ all : 0|64@1+ (1,0) [0|0] "" B
BO_ 259 Double: 8 A
 SG_ d : 0|64@1- (1,0) [0|0] "" B
BO_ 260 Choice: 2 A
 SG_ state : 0|3@1- (1,0) [0|0] "" B
 SG_ scaled : 7|4@0+ (0.5,1) [0|0] "" B
BO_ 261 Muxed: 8 A
 SG_ kind M : 0|4@1+ (1,0) [0|0] "" B
 SG_ always : 4|4@1+ (1,0) [0|0] "" B
 SG_ one m1 : 8|16@1+ (0.5,0) [0|0] "deg" B
 SG_ two m2 : 8|8@1- (1,0) [0|0] "" B
 SG_ also m2 : 16|8@1+ (1,0) [0|0] "" B
BO_ 262 Nested: 8 A
 SG_ outer M : 0|2@1+ (1,0) [0|0] "" B
 SG_ inner m1M : 2|2@1+ (1,0) [0|0] "" B
 SG_ leaf m0 : 8|8@1+ (1,0) [0|0] "" B
 SG_ other m2 : 8|8@1- (1,0) [0|0] "" B
 SG_ ranged m3 : 16|8@1+ (1,0) [0|0] "" B
BO_ 263 Long: 16 A
 SG_ far : 100|8@1+ (1,0) [0|0] "" B
SIG_VALTYPE_ 2566844672 f_le : 1;
SIG_VALTYPE_ 2566844672 f_be : 1;
SIG_VALTYPE_ 259 d : 2;
VAL_ 260 state -1 "broken" 0 "off" 1 "on" 3 "on";
VAL_ 260 scaled 2 "middle" ;
VAL_ 261 kind 1 "first" 2 "second" ;
SG_MUL_VAL_ 262 leaf inner 0-1;
SG_MUL_VAL_ 262 other inner 2-2;
SG_MUL_VAL_ 262 inner outer 1-1;
SG_MUL_VAL_ 262 ranged outer 2-3;
"""
START_US = 1_351_642_484_000_000


@pytest.fixture(scope="module")
def database() -> Database:
    return of_text(DBC, "some.dbc")


def random_frames(database: Database, n: int, seed: int = 1) -> FrameBatch:
    """n frames of each message, in any order; payloads of eight bytes whatever the message has."""
    rng = np.random.default_rng(seed)
    ids = np.repeat([m.can_id for m in database.messages], n)
    rng.shuffle(ids)
    return batch(ids, rng.integers(0, 256, (len(ids), 8), np.uint8))


def piece_of(frames: FrameBatch) -> Piece:
    n = len(frames)
    bus = np.where(np.arange(n) % 3 == 0, b"can1", b"can0").astype("S15")
    return Piece(START_US + 7 * np.arange(n), bus, frames, np.arange(n) % 2 == 1)


def by_cantools(text: str, frames: FrameBatch) -> list[tuple]:
    """(row, message, signal, value, text) of what cantools can decode."""
    theirs, rows = cantools.database.load_string(text, "dbc", strict=False), []
    for i in range(len(frames)):
        can_id = int(frames.can_id[i])
        extended = bool(can_id & EFF_FLAG)
        message = next(m for m in theirs.messages
                       if m.frame_id == can_id & 0x1FFF_FFFF and m.is_extended_frame == extended)  # fmt: skip
        octets = bytes(frames.data[i, : frames.length[i]])
        try:
            plain = message.decode(octets, decode_choices=False)
        except cantools.database.DecodeError:
            continue
        chosen = message.decode(octets)
        for name, value in plain.items():
            text = str(chosen[name]) if isinstance(chosen[name], NamedSignalValue) else None
            rows.append((i, message.name, name, float(value), text))
    return rows


def long_rows(tmp_path, database: Database, piece: Piece, undecoded: Undecoded) -> list[tuple]:
    path = tmp_path / "long.parquet"
    parquet.write(path, LongTable(database, undecoded).pieces(piece))
    table = pl.read_parquet(path)
    assert table.columns == ["time", "bus", "direction", "message", "signal", "value", "text", "unit"]
    at = ((table["time"].dt.epoch("us") - START_US) // 7).to_list()
    assert table["bus"].to_list() == ["can1" if i % 3 == 0 else "can0" for i in at]
    assert table["direction"].to_list() == ["Tx" if i % 2 else "Rx" for i in at]
    return list(
        zip(at, *(table[name].to_list() for name in ("message", "signal", "value", "text")), strict=True)
    )


def same(ours: list[tuple], theirs: list[tuple]) -> bool:
    """Equal to the last bit, nan (which is null) too; signals of a frame in any order."""

    def key(row):
        value = row[3]
        return (*row[:3], "none" if value is None or value != value else float.hex(value), row[4] or "")

    return sorted(map(key, ours)) == sorted(map(key, theirs))


def test_what_cantools_decodes_is_decoded_the_same(tmp_path, database, monkeypatch):
    monkeypatch.setattr(tables, "FRAMES", 100)
    frames = random_frames(database, 60)
    undecoded = Undecoded()
    ours = long_rows(tmp_path, database, piece_of(frames), undecoded)
    theirs = by_cantools(DBC, frames)
    decodable = {i for i, *_ in theirs}
    assert same([row for row in ours if row[0] in decodable], theirs) and len(theirs) > 700
    assert [row[0] for row in ours] == sorted(row[0] for row in ours)
    # cantools refuses frames whose multiplexer has a value of nothing: what does not depend on it is there
    rest = {row[2] for row in ours if row[0] not in decodable}
    assert rest <= {"kind", "always", "outer", "inner"} and undecoded.selected.total() > 10
    assert undecoded.short == {"Long": 60}


def test_our_contract_is_decoded_as_cantools_does(tmp_path):
    frames = random_frames(shipped(), 3, seed=2)
    assert same(
        long_rows(tmp_path, shipped(), piece_of(frames), Undecoded()), by_cantools(codec(4).text, frames)
    )


@pytest.mark.parametrize("name", ["Plain", "Floats", "Wide", "Double", "Choice", "Muxed", "Nested"])
def test_a_table_of_one_message_is_typed(tmp_path, database, name):
    frames, path = random_frames(database, 50), tmp_path / "one.parquet"
    parquet.write(path, MessageTable(database, database.named(name), Undecoded()).pieces(piece_of(frames)))
    table, message = pl.read_parquet(path), database.named(name)
    assert len(table) == 50
    assert table.schema["time"] == pl.Datetime("us", "UTC")
    at = ((table["time"].dt.epoch("us") - START_US) // 7).to_list()
    theirs = {
        (i, signal): (value, text) for i, of, signal, value, text in by_cantools(DBC, frames) if of == name
    }
    decodable = {i for i, _ in theirs}
    for s in message.signals:
        kind = table.schema[s.name]
        assert kind == (pl.UInt64 if s.bits == 64 and not s.signed else pl.Int64 if s.whole else pl.Float64)
        texts = table[f"{s.name}_text"].to_list() if s.choices else [None] * 50
        for i, value, text in zip(at, table[s.name].to_list(), texts, strict=True):
            if i in decodable:
                expected = theirs.get((i, s.name), (None, None))
                nothing = expected[0] is None or expected[0] != expected[0]
                assert (value is None) if nothing else float(value) == expected[0]
                assert text == expected[1]


def test_exact_values_of_words(tmp_path, database):
    """A whole word, which no float holds, is exact in the table of its message."""
    frames = batch([257 | EFF_FLAG] * 2, np.array([[255] * 8, [1, 0, 0, 0, 0, 0, 0, 128]], np.uint8))
    path = tmp_path / "wide.parquet"
    parquet.write(path, MessageTable(database, database.named("Wide"), Undecoded()).pieces(piece_of(frames)))
    assert pl.read_parquet(path)["all"].to_list() == [2**64 - 1, 2**63 + 1]


@pytest.fixture
def recording(tmp_path, database):
    """A log with frames of all kinds."""
    (tmp_path / "some.dbc").write_text(DBC)
    plain = struct.pack("<Q", 0x0123_4567_89AB_CDEF).hex().upper()
    lines = [f"can0 101#{plain}", "can0 101#0102", "can1 7FF#01", "can0 7FE#", "can0 7FF#", "can0 101#R8",
             "can0 20000004#0000000000000000", "can0 104#0700 T", "can0 105#3F",
             "can0 105#0F00000000000000"]  # fmt: skip
    log = tmp_path / "some.log"
    log.write_text("".join(f"(1351642484.{i:06d}) {line}\n" for i, line in enumerate(lines)))
    return log


def test_convert_writes_signals_and_tells_what_is_left(recording, tmp_path, capsys):
    out = tmp_path / "out.parquet"
    words = ["convert", str(recording), str(out), "--dbc", str(tmp_path / "some.dbc")]
    assert main(words) == 0
    told = capsys.readouterr()
    assert told.out == f"{out}: 9 rows of 10 frames, 1 error frame among them, 1 remote frame among them\n"
    assert [line.split(": ", 2)[-1] for line in told.err.splitlines()] == [
        "1 error frame has no signals", "1 remote frame has no signals",
        f"3 frames are of identifiers that {tmp_path}/some.dbc does not have: 7FF, 7FE",
        "1 frame is shorter than Plain", "1 frame is shorter than Muxed",
        "1 frame has a value of Muxed.kind that no signal belongs to",
    ]  # fmt: skip
    table = pl.read_parquet(out)
    assert table["message"].to_list() == ["Plain"] * 5 + ["Choice"] * 2 + ["Muxed"] * 2
    state = table.filter(pl.col("signal") == "state").row(0, named=True)
    assert state.pop("time") == datetime.fromtimestamp(1351642484.000007, UTC)
    assert list(state.values()) == ["can0", "Tx", "Choice", "state", -1.0, "broken", ""]
    assert main(words) == 2
    assert "exists; --force overwrites it" in capsys.readouterr().err
    assert main([*words, "--force", "--message", "Choice"]) == 0
    assert pl.read_parquet(out)["state_text"].to_list() == ["broken"]


def test_mistakes_get_a_line_and_leave_nothing(recording, tmp_path, capsys):
    dbc, out = tmp_path / "some.dbc", tmp_path / "out.parquet"
    (tmp_path / "bad.dbc").write_text("BO_ none\n")
    (tmp_path / "blank.dbc").write_text("\n")
    (tmp_path / "empty.dbc").write_text('VERSION ""\n')
    for more, says in (
        ([out, "--dbc", tmp_path / "none.dbc"], "none.dbc: no such file"),
        ([out, "--dbc", tmp_path / "bad.dbc"], "bad.dbc: cannot be read: "),
        ([out, "--dbc", tmp_path / "empty.dbc"], "empty.dbc: has no message with a signal"),
        ([out, "--dbc", dbc, "--message", "plai"], "some.dbc: has no message plai; near it: Plain"),
        ([out, "--dbc", dbc, "--message", "Plian"], "some.dbc: has no message Plian; did you mean 'Plain'?"),
        ([out, "--dbc", tmp_path / "blank.dbc"], "blank.dbc: is empty"),
        ([tmp_path / "out.asc", "--dbc", dbc], "--dbc: is for signals; name a .parquet file"),
        (
            [tmp_path / "out.csv"],
            "suffix '.csv' is no recording; allowed are .log, .asc, .blf, .mf4, .parquet",
        ),
    ):
        assert main(["convert", str(recording), *map(str, more)]) == 2
        said = capsys.readouterr().err
        assert says in said and said.count("\n") == 1, said
        assert not out.exists()
    (tmp_path / "cut.log").write_text("nothing of the kind\n")
    assert main(["convert", str(tmp_path / "cut.log"), str(out), "--dbc", str(dbc)]) == 2
    assert not list(tmp_path.glob("*.parquet")) and not list(tmp_path.glob(".*draft*"))


def test_a_run_is_decoded_by_the_contract_it_speaks(tmp_path, capsys):
    run, out = tmp_path / "run", tmp_path / "out.parquet"
    assert main(["run", "soyuz", "--bus", "inline", "--duration", "5", "--out", str(run), "--quiet"]) == 0
    capsys.readouterr()
    assert main(["convert", str(run), str(out)]) == 0
    assert capsys.readouterr().err == ""
    epochs = pl.read_parquet(out).filter((pl.col("message") == "TIME_MARK") & (pl.col("signal") == "epoch"))
    assert epochs["value"].to_list() == [0, 1, 2, 3, 4]


def test_a_dbc_may_have_a_byte_order_mark_and_overlapping_signals(tmp_path):
    path = tmp_path / "marked.dbc"
    more = ' SG_ again : 3|4@1+ (1,0) [0|0] "°C" B\n'
    path.write_text("\ufeff" + DBC.replace("BO_ 2566844672", more + "BO_ 2566844672"), "utf-8")
    plain = load(path).named("Plain")
    assert "again" in {s.name for s in plain.signals}
    assert {s.unit for s in plain.signals} == {"", "m", "km", "°C"}


def test_rows_of_two_buses_are_in_the_order_of_time(tmp_path):
    """The log of a run of two craft tells an epoch of one bus after the other."""
    (tmp_path / "some.dbc").write_text(DBC)
    lines = [(epoch, bus, i) for epoch in range(3) for bus in range(2) for i in range(4)]
    log = tmp_path / "two.log"
    log.write_text("".join(f"({e}.{1000 * i:06d}) can{b} 104#0{b}00\n" for e, b, i in lines))
    words = [
        str(log),
        str(tmp_path / "a.parquet"),
        "--dbc",
        str(tmp_path / "some.dbc"),
        "--message",
        "Choice",
    ]
    assert main(["convert", *words]) == 0
    table = pl.read_parquet(tmp_path / "a.parquet")
    assert table["time"].is_sorted() and len(table) == 24
    assert table["bus"].to_list() == ["can0", "can1"] * 12


def test_an_empty_recording_is_a_table_without_rows(tmp_path):
    (tmp_path / "a.log").write_text("")
    assert main(["convert", str(tmp_path / "a.log"), str(tmp_path / "a.parquet")]) == 1
    assert pl.read_parquet(tmp_path / "a.parquet").shape == (0, 8)


def test_names_of_messages_are_looked_for(database):
    with pytest.raises(Mistake, match=r"has no message uxe; near it: Muxed"):
        database.named("uxe")
