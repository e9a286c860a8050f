"""The tables of a run come out the same, made while it runs or from its log afterwards."""

from __future__ import annotations

import json

import numpy as np
import polars
import pytest
from polars.testing import assert_frame_equal

from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.results.run_digest import CHANNELS, RunDigest, from_log
from gnss_hil.tools.results.tables import ParquetTable, remove_parts
from tests.support.live_runs import epochs, soyuz

TABLES = ("fixes", "channels", "assignments", "epochs", "truth")


def damaged() -> list[FrameBatch]:
    """Real epochs with a bit error, a lost frame, a repeated one, strangers, a late answer, a lost mark."""
    blocks = list(epochs()[0])
    data = blocks[60].data.copy()
    data[30, 5] ^= 4
    blocks[60] = FrameBatch(blocks[60].t_ns, blocks[60].can_id, blocks[60].length, data)
    blocks[61] = blocks[61][np.arange(len(blocks[61])) != 40]
    blocks[62] = concat((blocks[62], blocks[62][20:25]))
    blocks[63] = concat((blocks[63], batch([0x7AB, 0x1ABCDEF0 | 0x8000_0000], b"12345678")))
    blocks[65] = concat((blocks[65], blocks[64][-10:]))
    blocks[64] = blocks[64][:-10]
    blocks[66] = blocks[66][1:]
    return blocks


def flat(digest) -> dict[str, np.ndarray]:
    """Everything that a digest knows, by name."""
    tables = {
        "fixes": digest.fixes, "timeline": digest.timeline, "almanac": digest.almanac.rows,
        "tags": digest.tags.rows, "commands": digest.commands.events,
    }  # fmt: skip
    columns = {f"{table}.{name}": np.asarray(c) for table, cs in tables.items() for name, c in cs.items()}
    counted = digest.counters
    return columns | {
        "bits": digest.bits,
        "counted": np.array([counted.received, counted.lost, *counted.reasons.values()]),
        "handed": np.array(digest.commands.handed),
    }


@pytest.mark.parametrize("batch_frames", [1, 1000, 10**6])
def test_while_it_runs_or_from_its_log_a_digest_is_the_same(tmp_path, monkeypatch, batch_frames):
    monkeypatch.setattr("gnss_hil.tools.recording.recorder.BATCH_FRAMES", batch_frames)
    plan, blocks = soyuz(), damaged()
    for name in ("live", "again"):
        (tmp_path / name).mkdir()
    live = RunDigest(tmp_path / "live", plan.names, plan.codecs)
    with (tmp_path / "again" / "bus.log").open("wb") as log:
        time = plan.scenario.time
        recorder = Recorder({"can0": plan.codecs[0]}, time.start_ns, time.interval_ns, log, live.feed)
        for epoch, block in enumerate(blocks):
            recorder.add(0, epoch, block)
        recorder.flush()
    (first,) = live.finish().values()
    (second,) = from_log(tmp_path / "again" / "bus.log", plan.names, plan.codecs).values()
    assert set(first.counters.reasons) >= {"CORRUPTED", "REPEATED", "UNKNOWN_ID", "EXTENDED"}
    ours, theirs = flat(first), flat(second)
    assert ours.keys() == theirs.keys() and len(ours["fixes.t_ns"]) > 30
    for name in ours:
        np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)
    tables = [polars.read_parquet(tmp_path / name / CHANNELS) for name in ("live", "again")]
    assert_frame_equal(*tables, check_exact=True)
    assert len(tables[0]) > 300
    assert not list(tmp_path.rglob(".*"))


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["soyuz", "pair"])
def test_a_run_reported_again_has_the_same_tables_and_summary(tmp_path, scenario, capsys):
    run = tmp_path / "run"
    arguments = ["--bus", "inline", "--duration", "90", "--out", str(run), "--quiet", "--no-report"]
    assert main(["run", scenario, *arguments]) == 0
    before = {name: polars.read_parquet(run / f"{name}.parquet") for name in TABLES}
    summary = json.loads((run / "summary.json").read_text())
    for name in TABLES:
        (run / f"{name}.parquet").unlink()
    assert main(["report", str(run)]) == 0
    for name, table in before.items():
        assert_frame_equal(table, polars.read_parquet(run / f"{name}.parquet"), check_exact=True)
    assert json.loads((run / "summary.json").read_text()) == summary


def test_parts_of_a_run_that_died_are_removed(tmp_path):
    (tmp_path / ".channels-parts-x").mkdir()
    (tmp_path / ".channels-parts-x" / "000000.parquet").touch()
    (tmp_path / "bus.log").touch()
    remove_parts(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["bus.log"]


def test_sections_of_a_table_follow_each_other(tmp_path, monkeypatch):
    """However the pieces of two craft come, and whenever parts are written."""
    monkeypatch.setattr("gnss_hil.tools.results.tables._ROWS_PER_PART", 5)
    pieces = [
        (section, np.arange(n) + 10 * n + 100 * section) for section, n in ((1, 4), (0, 3), (1, 7), (0, 9))
    ]
    table = ParquetTable(tmp_path / "rows.parquet")
    for section, rows in pieces:
        table.add({"row": rows}, section)
    table.close()
    wanted = [
        row for craft in (0, 1) for section, rows in pieces if section == craft for row in rows.tolist()
    ]
    assert polars.read_parquet(tmp_path / "rows.parquet")["row"].to_list() == wanted
    assert [path.name for path in tmp_path.iterdir()] == ["rows.parquet"]
