"""A file is there whole or not at all, whatever ends its writing."""

from __future__ import annotations

import errno

import pytest

from gnss_hil.tools.common.whole_file import draft_of

pytestmark = pytest.mark.verifies(
    "tools/common/whole_file.py",
    what="Files written whole or not at all",
    by="rules of ours",
    status="modelled",
)


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "Some.LOG"
    path.write_text("before")
    return path


def test_what_is_written_takes_its_place_at_the_end(path):
    with draft_of(path) as draft:
        draft.write_text("after")
        assert (draft.parent, draft.suffix) == (path.parent, ".log")
        assert path.read_text() == "before"
    assert path.read_text() == "after"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_what_is_broken_off_leaves_all_as_it_was(path, error):
    with pytest.raises(error), draft_of(path) as draft:
        draft.write_text("aft")
        raise error
    assert path.read_text() == "before"
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_names_the_file(path):
    with pytest.raises(OSError, match="No space left") as caught, draft_of(path) as draft:
        draft.write_text("aft")
        raise OSError(errno.ENOSPC, "No space left on device")
    assert caught.value.filename == str(path)


def test_a_folder_in_its_place_is_named(tmp_path):
    with pytest.raises(IsADirectoryError) as caught, draft_of(tmp_path) as draft:
        draft.write_text("after")
    assert (caught.value.filename, caught.value.filename2) == (str(tmp_path), None)
    assert not draft.exists()


def test_another_file_that_fails_keeps_its_name(path):
    with pytest.raises(FileNotFoundError) as caught, draft_of(path):
        (path.parent / "missing").read_text()
    assert caught.value.filename == str(path.parent / "missing")
