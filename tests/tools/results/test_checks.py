"""What each check saw in a log into which faults were written by hand: those, no others, where and when."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from gnss_hil.dbc.contract import codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.screening import Verdict
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.decoder.refusals import REASONS, Refusals
from gnss_hil.tools.results import checks, outages, parquet
from gnss_hil.tools.results.run_digest import feed_log
from tests.support.hurt_logs import Log
from tests.support.runs import summary_of

pytestmark = pytest.mark.verifies(
    "tools/results/checks.py",
    "tools/decoder/refusals.py",
    "tools/decoder/nodes.py",
    what="What each check saw, by epoch",
    by="faults written into a log by hand, named by cantools",
    status="validated",
)

DURATION = 62
BENCH, NO_FIX = checks.BENCH, outages.REASONS
FIRST_FIX = 36
BEGIN_GPS_S = 1712 * 604_800 + 3 * 86_400 + 900.0  # of soyuz: GPS week 1712, Wednesday, 00:15


@pytest.fixture(scope="module")
def flown(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "run"
    arguments = ["--duration", str(DURATION), "--bus", "inline", "--no-report", "--quiet", "--out"]
    assert main(["run", "soyuz", *arguments, str(folder)]) == 0
    return folder


def table(folder: Path, marks: bool = True) -> list[tuple]:
    """Rows: seconds since the first epoch, check, where, count; `marks`: their times are those of epochs."""
    rows = pl.read_parquet(folder / "checks.parquet").rows()
    assert {row[0] for row in rows} <= {"soyuz"}
    rows = [row for row in rows if row[-1] == BENCH or row[3] in NO_FIX]  # what NAV_REFUSED says: apart
    found = [(None if t is None else t - BEGIN_GPS_S, *rest) for _, t, _, *rest, _ in rows]
    assert not marks or [row[0] for row in found] == [row[2] for row in rows]
    return found


COLD = [(float(t), "TOO_FEW_SATELLITES", "FLIGHT", 1) for t in range(FIRST_FIX)]


def test_a_sound_run_has_nothing_but_its_cold_start(flown):
    assert table(flown) == COLD


def test_every_fault_is_seen_by_its_check_where_it_is_and_nothing_else_is(flown, tmp_path, capsys):
    log = copied(flown, tmp_path)
    expected: Counter[tuple] = Counter()

    at = log.row(40, "RX3_RANGE")  # a bit: refused, and missed in the next epoch
    flipped = log.epochs[40][at]
    log.epochs[40][at] = f"{flipped[:-1]}{int(flipped[-1], 16) ^ 1:X}"
    expected[40.0, "CORRUPTED", "RX3_RANGE"] += 1
    expected[41.0, "LOST", "RX3_RANGE"] += 1

    at = log.row(45, "RX1_RATE")
    log.epochs[45].insert(at, log.epochs[45][at])
    expected[45.0, "REPEATED", "RX1_RATE"] += 1

    gone: set[tuple] = set()
    for epoch in (50, 51):  # counters go on by three: what comes then is used, and told
        gone |= log.take_out(epoch, lambda line: "RX2" in log.message(line).senders)
        expected[float(epoch), "SILENCE", "RX2"] += 1
    expected += log.missed(gone, 52)

    gone = log.take_out(58, lambda line: log.name(line).startswith("NAV_"))
    expected[58.0, "NOT_REPORTED", "FLIGHT"] += 1
    expected += log.missed(gone, 59)

    log.epochs[55] += [log.like(55, "5A0"), log.like(55, "1ABCDE00")]
    expected[55.0, "UNKNOWN_ID", "0x5A0"] += 1
    expected[55.0, "EXTENDED", "0x1ABCDE00"] += 1

    heard = log.epochs[0][log.row(0, "ATT_Q01")]
    expected[None, "BEFORE_FIRST_MARK", "ATT_Q01"] += 1
    expected[0.0, "REPEATED", "ATT_Q01"] += 1  # the same frame in its own place

    assert main(["report", str(log.written([heard]))]) == 0
    capsys.readouterr()
    found = table(tmp_path)
    assert Counter({row[:3]: row[3] for row in found if row not in COLD}) == expected
    times = [row[0] for row in found]
    assert times == sorted(times, key=lambda t: -1.0 if t is None else t)
    refused = Counter()
    for _, check, _, count in found:
        if check in checks.REJECTIONS:
            refused[check] += count
    assert refused == summary_of(tmp_path)["frames"]["rejected"]


def copied(flown: Path, tmp_path: Path) -> Log:
    for name in ("bus.log", "truth", "scenario.toml", "vehicle.toml", "run.json"):
        (tmp_path / name).write_bytes((flown / name).read_bytes())
    return Log(tmp_path)


def seen(log: Log, check: str, capsys) -> list[tuple]:
    assert main(["report", str(log.written([]))]) == 0
    capsys.readouterr()
    return [row for row in table(log.path.parent, marks=False) if row[1] == check]


def test_a_boot_count_that_changes_is_a_restart(flown, tmp_path, capsys):
    log = copied(flown, tmp_path)
    for epoch in range(44, DURATION):
        log.rewrite(epoch, "RX3_HEARTBEAT", boot_count=7 if epoch < 50 else 8)
    assert seen(log, "RESTART", capsys) == [(44.0, "RESTART", "RX3", 1), (50.0, "RESTART", "RX3", 1)]


def test_a_node_is_silent_only_after_it_was_heard(flown, tmp_path, capsys):
    log = copied(flown, tmp_path)
    for epoch in (*range(20), 30):
        log.take_out(epoch, lambda line: "RX4" in log.message(line).senders)
    assert seen(log, "SILENCE", capsys) == [(30.0, "SILENCE", "RX4", 1)]


@pytest.mark.parametrize("piece", [100, 1000])
def test_the_table_does_not_depend_on_the_pieces_of_the_log(flown, tmp_path, piece):
    log = copied(flown, tmp_path)
    for epoch in range(44, DURATION):
        log.rewrite(epoch, "RX3_HEARTBEAT", boot_count=7)
    log.take_out(50, lambda line: "RX2" in log.message(line).senders)
    log.written([])
    tables = []
    for size in (10**6, piece):
        digest = Digest(codec.codec(4))
        feed_log(log.path, ["can0"], lambda _, frames, size=size, digest=digest: fed(digest, frames, size))
        digest.finish()
        parquet.write(tmp_path / f"{size}.parquet", [checks.columns("soyuz", digest)])
        tables.append(pl.read_parquet(tmp_path / f"{size}.parquet"))
    assert tables[0].equals(tables[1])
    assert {"RESTART", "SILENCE", "LOST"} <= set(tables[0]["check"])


def fed(digest: Digest, frames: FrameBatch, size: int) -> None:
    for begin in range(0, len(frames), size):
        digest.feed(frames[begin : begin + size])


def test_a_mark_that_is_missing_or_jumps_is_told_there_and_where_the_next_one_is(flown, tmp_path, capsys):
    log = copied(flown, tmp_path)
    seconds = 3 * 86_400 + 900
    log.take_out(40, lambda line: log.name(line) == "TIME_MARK")
    for epoch in range(50, DURATION):  # five seconds on, and so they stay
        log.rewrite(epoch, "TIME_GPS", second=seconds + epoch + 5)
    assert [row[0] for row in seen(log, "MARK", capsys)] == [None, 41.0, 55.0]


@pytest.mark.parametrize("piece", [1, 7, 1000])
def test_rows_do_not_depend_on_the_pieces_they_came_in(piece):
    draw = np.random.default_rng(3)
    n = 1000
    epoch = np.sort(draw.integers(-1, 5, n))
    reason = draw.integers(0, len(REASONS), n)
    can_id = draw.choice(np.array([0x100, 0x7FF, 0x9ABCDE00, 0x80000000], np.uint32), n)
    refusals = Refusals()
    for begin in range(0, n, piece):
        part = slice(begin, begin + piece)
        refusals.add(epoch[part], reason[part], can_id[part])
    found = {
        tuple(row[:3]): row[3] for row in zip(*(v.tolist() for v in refusals.rows.values()), strict=True)
    }
    assert found == Counter(zip(epoch.tolist(), reason.tolist(), can_id.tolist(), strict=True))


def test_a_run_without_an_epoch_has_the_columns(tmp_path):
    digest = Digest(codec.codec(4))
    digest.finish()
    parquet.write(tmp_path / "none.parquet", [checks.columns("soyuz", digest)])
    assert pl.read_parquet(tmp_path / "none.parquet").schema == {
        "craft": pl.String, "t_gps_s": pl.Float64, "epoch": pl.Int64, "check": pl.String, "where": pl.String,
        "count": pl.Int64, "by": pl.String,
    }  # fmt: skip


def test_names_of_checks_are_told_apart():
    assert len(set(checks.CHECKS)) == len(checks.CHECKS)
    assert set(checks.REJECTIONS) == {v.name for v in Verdict if v > Verdict.LOST} | {"BEFORE_FIRST_MARK"}


@pytest.mark.parametrize(
    ("said", "reckoned"),
    [
        ([4, 5, 6], [4, 5, 6]), ([4, -1, -1, 7], [4, 5, 6, 7]), ([4, -1, 7], [4, -1, 7]), ([-1, 4], [-1, 4]),
        ([4, -1, -1], [4, 5, 6]), ([-1, -1], [-1, -1]), ([9, -1, 3, -1, 5], [9, -1, 3, 4, 5]), ([], []),
    ],
)  # fmt: skip
def test_an_epoch_without_a_mark_is_reckoned_from_those_around_it(said, reckoned):
    assert checks.reckoned(np.array(said, np.int64)).tolist() == reckoned
