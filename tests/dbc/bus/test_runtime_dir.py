"""The bus's private folder: where it is, and what becomes of those of the dead."""

from __future__ import annotations

import tempfile
from pathlib import Path

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir


def test_a_long_name_of_the_temporary_folder_is_no_hindrance(tmp_path, monkeypatch):
    deep = tmp_path / ("d" * 100)
    deep.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(deep))
    with RuntimeDir() as private, Hub(private / "can0"):
        assert private.parent == Path("/tmp")
        assert private.stat().st_mode & 0o777 == 0o700
    assert not private.exists() and not list(deep.iterdir())


def test_the_private_folder_is_where_temporary_things_belong(monkeypatch):
    with RuntimeDir() as outer:
        monkeypatch.setattr(tempfile, "tempdir", str(outer))
        with RuntimeDir() as private:
            assert private.parent == outer


def test_a_folder_that_nobody_holds_is_removed_and_all_others_stay(monkeypatch):
    with RuntimeDir() as outer:
        monkeypatch.setattr(tempfile, "tempdir", str(outer))
        abandoned, file = (outer / f"{outer.name[:-8]}{name}" for name in "ab")
        other = outer / "gnss-hil-bus-000000-c"  # of another kernel, whose locks are not seen from here
        abandoned.mkdir()
        (abandoned / "can0").touch()
        file.touch()
        other.mkdir()
        with RuntimeDir() as first, RuntimeDir() as second:
            assert set(outer.iterdir()) == {file, other, first, second}
        assert set(outer.iterdir()) == {file, other}
