"""Parquet files of ours as polars reads them, and files that are none."""

from __future__ import annotations

import numpy as np
import polars
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.parquet import Damaged, Labelled, Partial

pytestmark = pytest.mark.verifies(
    "tools/results/parquet.py",
    what="Columns to and from Parquet",
    by="polars reads what is written, and writes what is read",
    status="validated",
)
COLUMNS = {
    "craft": Labelled(np.array([0, 1, 1], np.uint8), ("a", "b")),
    "t_gps_s": np.array([1035677736.25, 1035677737.25, 1035677738.25]),
    "pdop": np.array([np.nan, 1.5, np.inf]),
    "mode": np.array(["FIX", "NONE", "FIX"]),
    "bits": np.array([1, -2, 1 << 60]),
    "short": np.array([1, 2, 255], np.uint8),
    "used": np.array([True, False, True]),
}


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "some.parquet"
    parquet.write(path, [COLUMNS, COLUMNS])
    return path


def test_rows_do_not_depend_on_how_many_are_held(tmp_path, monkeypatch, table):
    monkeypatch.setattr(parquet, "BATCH_ROWS", 2)
    path = tmp_path / "in-groups.parquet"
    parquet.write(path, [COLUMNS, COLUMNS])
    assert polars.read_parquet(path).equals(polars.read_parquet(table), null_equal=True)
    assert sum(len(batch["bits"]) for batch in parquet.read(path)) == 6
    assert path.stat().st_size > table.stat().st_size, "groups of two rows"


def test_polars_reads_what_was_written(table):
    read = polars.read_parquet(table)
    assert read.columns == list(COLUMNS)
    assert read.dtypes == [polars.String, polars.Float64, polars.Float64, polars.String, polars.Int64,
                           polars.UInt8, polars.Boolean]  # fmt: skip
    assert read["craft"].to_list() == ["a", "b", "b"] * 2
    assert read["mode"].to_list() == ["FIX", "NONE", "FIX"] * 2
    assert read["pdop"].to_list() == [None, 1.5, np.inf] * 2
    for name in ("t_gps_s", "bits", "short", "used"):
        assert read[name].to_list() == COLUMNS[name].tolist() * 2


def test_files_are_joined_in_order(table, tmp_path):
    parquet.join(tmp_path / "joined.parquet", [table, table])
    read = polars.read_parquet(table)
    assert polars.read_parquet(tmp_path / "joined.parquet").equals(polars.concat([read, read]))


def test_nulls_of_numbers_and_truths_survive_a_join_with_parts_that_have_none(table, tmp_path):
    """A part without a null is of the same kind as one with: they become one column."""
    some, every = np.array([True, False, True]), np.ones(3, bool)
    pieces = [
        {name: Partial(np.asarray(COLUMNS[name]), present) for name in ("short", "used")}
        | {"pdop": COLUMNS["pdop"]}
        for present in (every, some)
    ]
    for k, piece in enumerate(pieces):
        parquet.write(tmp_path / f"{k}.parquet", [piece])
    for order in ((0, 1), (1, 0)):
        joined = tmp_path / "joined.parquet"
        parquet.join(joined, [tmp_path / f"{k}.parquet" for k in order])
        read = polars.read_parquet(joined)
        assert read.dtypes == [polars.UInt8, polars.Boolean, polars.Float64]
        of_each = {0: ([1, 2, 255], [True, False, True]), 1: ([1, None, 255], [True, None, True])}
        assert read["short"].to_list() == [value for k in order for value in of_each[k][0]]
        assert read["used"].to_list() == [value for k in order for value in of_each[k][1]]


def test_reads_tables_of_a_data_frame_library(tmp_path):
    """As run folders of before have them."""
    path = tmp_path / "polars.parquet"
    polars.DataFrame({"craft": ["a", "b", "a"], "v": [1.0, None, 3.0]}).write_parquet(path)
    assert parquet.of_craft(path, "a", ["v"])["v"].tolist() == [1.0, 3.0]
    assert np.isnan(parquet.of_craft(path, "b", ["v"])["v"]).all()
    assert parquet.of_craft(path, "c", ["v"])["v"].tolist() == []


def test_rows_of_a_craft(table):
    assert parquet.of_craft(table, "b", ["short", "pdop"])["short"].tolist() == [2, 255, 2, 255]
    (batch,) = parquet.batches_of_craft(table, "a", ["mode"])
    mode = batch["mode"]
    assert isinstance(mode, Labelled)
    assert [mode.labels[code] for code in mode.codes] == ["FIX", "FIX"]


@given(values=st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=50))
@settings(max_examples=30)
def test_numbers_come_back(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("numbers") / "numbers.parquet"
    parquet.write(path, [{"v": np.array(values)}])
    (batch,) = parquet.read(path)
    np.testing.assert_array_equal(batch["v"], values)


def test_columns_that_are_not_there(table):
    with pytest.raises(Damaged, match="has no column mission"):
        list(parquet.read(table, ["mission"]))


@pytest.mark.parametrize("keep", [0, 3, 11, 400, -1])
def test_a_file_cut_short_is_told(table, keep):
    table.write_bytes(table.read_bytes()[:keep])
    with pytest.raises(Damaged, match=r"some\.parquet: not a Parquet file"):
        list(parquet.read(table))


def test_a_file_with_another_footer_is_told(table):
    """The library panics there; that is no reason to."""
    whole = table.read_bytes()
    at = len(whole) - 8 - int.from_bytes(whole[-8:-4], "little")
    table.write_bytes(whole[:at] + b"\xff" * (len(whole) - 8 - at) + whole[-8:])
    with pytest.raises(Damaged, match="damaged"):
        list(parquet.read(table))


@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt, MemoryError, PermissionError])
@pytest.mark.parametrize("during", ["opening", "rows"])
def test_what_is_no_fault_of_the_file_passes(table, monkeypatch, error, during):
    def fail(*_, **__):
        raise error()

    place = "arro3.io.read_parquet" if during == "opening" else "gnss_hil.tools.results.parquet._numbers"
    monkeypatch.setattr(place, fail)
    with pytest.raises(error):
        list(parquet.read(table))


@pytest.mark.parametrize(("message", "shown"), [("", "Exception"), ("first\nsecond", "first$")])
def test_a_fault_in_the_rows_is_one_line(table, monkeypatch, message, shown):
    def fail(_):
        raise Exception(message)

    monkeypatch.setattr(parquet, "_numbers", fail)
    with pytest.raises(Damaged, match=rf"some\.parquet: {shown}"):
        list(parquet.read(table))
