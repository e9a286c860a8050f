"""Tables of whatever the contract lets pass: values that its value tables do not name."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract import codec, e2e
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import tables
from gnss_hil.tools.results.summary import build
from tests.support.outside import peer

polars = peer("polars")

CODEC = codec.codec(4)
FACTS = {"scenario": "extremes", "pace": "lockstep", "epoch_interval_s": 1.0, "epochs_unanswered": 0}


def at_maximum(can_id: int) -> FrameBatch:
    """The frame with every bit behind its protection header set."""
    return batch([can_id], np.full((1, 8), 255, np.uint8))


def extremes(epoch: int) -> list[FrameBatch]:
    """An epoch of all recorded frames of the bus, every field at its maximum; its times are ordinary."""
    times = {
        "TIME_MARK": {"session": 1, "epoch": epoch},
        "TIME_GPS": {"week": 1712, "second": epoch},
        "TIME_FINE": {"nanosecond": 0, "leap": 16, "mark_clock": 0},
    }
    opening = [batch([CODEC.can_id_of[kind, 0]], CODEC.encode(kind, said, 1)) for kind, said in times.items()]
    others = [
        at_maximum(can_id)
        for (kind, _), can_id in CODEC.can_id_of.items()
        if kind not in times and not kind.startswith("BENCH_")
    ]
    return [*opening, *others]


def test_every_field_at_its_maximum_reaches_the_tables_and_the_summary(tmp_path):
    counters, channels = e2e.fresh_counters(CODEC), []
    digest = Digest(CODEC, channels.append)
    for epoch in range(3):
        frames, counters = e2e.protect(CODEC, concat(extremes(epoch)), counters, epoch)
        digest.feed(frames)
    digest.finish()
    assert digest.counters.reasons == {}

    tables.write_fixes_and_truth(tmp_path, {"soyuz": digest}, None)
    table = tables.ParquetTable(tmp_path / "channels.parquet")
    for cells in channels:
        table.add(tables.columns_of(tables.CHANNELS, "soyuz", cells))
    table.close()

    fixes = polars.read_parquet(tmp_path / "fixes.parquet")
    assert (fixes["mode"].to_list(), fixes["no_fix"].to_list()) == (["7"] * 3, ["15"] * 3)
    assert not fixes["valid"].any()
    cells = polars.read_parquet(tmp_path / "channels.parquet")
    assert cells.height == 3 * 4
    assert set(cells["satellite"]) == {"7:63"}
    assignments = polars.read_parquet(tmp_path / "assignments.parquet")
    assert set(assignments["satellite"]) == {"7:63"}
    assert set(assignments["event"]) == {"ack", "command", "repeat"}
    figures = build(FACTS | {"epochs": 3}, {"soyuz": digest}, None)["craft"]["soyuz"]
    assert (figures["fixes"], figures["assignment"]["rejected"]) == (0, 3 * 4)


def written(folder, digest: Digest, channels: list) -> dict:
    tables.write_fixes_and_truth(folder, {"soyuz": digest}, None)
    table = tables.ParquetTable(folder / "channels.parquet")
    for cells in channels:
        table.add(tables.columns_of(tables.CHANNELS, "soyuz", cells))
    table.close()
    return {path.name: polars.read_parquet(path) for path in folder.glob("*.parquet")}


TABLES = ("epochs", "fixes", "assignments", "channels", "checks")


def test_tables_without_a_row_have_the_columns_of_those_with_rows(tmp_path):
    found = {}
    for name, epochs in (("full", 2), ("empty", 0)):
        counters, channels = e2e.fresh_counters(CODEC), []
        digest = Digest(CODEC, channels.append)
        for epoch in range(epochs):
            frames, counters = e2e.protect(CODEC, concat(extremes(epoch)), counters, epoch)
            digest.feed(frames)
        digest.finish()
        (tmp_path / name).mkdir()
        found[name] = written(tmp_path / name, digest, channels)
    assert set(found["empty"]) == {f"{t}.parquet" for t in TABLES}
    for name, full in found["full"].items():
        assert full.height > 0
        assert found["empty"][name].height == 0
        assert found["empty"][name].schema == full.schema


@pytest.mark.parametrize(("table", "raw"), [("NavMode", 7), ("NoFix", 15), ("Signal", 15), ("Lock", 7)])
def test_what_a_value_table_does_not_name_is_its_number(table, raw):
    first = tables.VALUES[table][0]
    column = tables._labelled(table, np.array([raw, 0]))
    assert [column.labels[code] for code in column.codes] == [str(raw), first]
