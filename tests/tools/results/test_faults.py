"""faults.parquet from the stream of a run."""

from __future__ import annotations

import polars

from gnss_hil.emulator.faults import ledger
from gnss_hil.tools.results import faults
from tests.support.faulted import plan_of, strike


def test_the_table_has_what_the_stream_has(tmp_path):
    lines = ["ATT loss @100+5 name=quiet", "rx2 off @30..50"]
    given = [(0, event) for one in strike(*lines) for event in one.events]
    text = ledger.header([plan_of(*lines)]) + "".join(ledger.line(*one) for one in given)
    (tmp_path / "faults").write_text(text)
    faults.write(tmp_path)
    table = polars.read_parquet(tmp_path / "faults.parquet")
    assert table.columns == [
        "craft", "fault", "kind", "place", "direction", "active", "first_epoch", "last_epoch", "epochs",
        "frames_touched", "frames_missing", "values_clipped", "first_struck",
    ]  # fmt: skip
    assert table["fault"].to_list() == ["receiver-off 2", "receiver-off 2", "quiet"]
    assert table["frames_touched"].sum() == sum(event.touched for _, event in given)
    assert table["first_struck"].to_list()[2] == 100
    assert table["frames_missing"].to_list()[2] == table["frames_touched"].to_list()[2] == 20
    assert table.row(2)[:6] == ("soyuz", "quiet", "loss", "ATT", "flight", True)


def test_faults_that_never_acted_leave_a_table_without_rows(tmp_path):
    (tmp_path / "faults").write_text(ledger.header([plan_of("ATT loss @500")]))
    faults.write(tmp_path)
    assert polars.read_parquet(tmp_path / "faults.parquet").height == 0


def test_a_run_without_faults_has_no_table(tmp_path):
    faults.write(tmp_path)
    assert faults.read(tmp_path) == ([], []) and not list(tmp_path.iterdir())
