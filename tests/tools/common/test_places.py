"""What is there stays: every command that writes files refuses what is taken, and says what overwrites."""

from __future__ import annotations

from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.common.places import check_new_file, check_new_files, check_new_folder, make_folder

pytestmark = pytest.mark.verifies(
    "tools/common/places.py",
    what="Where commands may write",
    by="rules of ours: nothing that is there is overwritten without --force",
    status="modelled",
)

MINE = "a week's work"


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A run folder."""
    folder = tmp_path_factory.mktemp("places") / "run"
    assert main(["run", "--bus", "inline", "--duration", "2", "--quiet", "--out", str(folder)]) == 0
    return folder


@pytest.mark.parametrize(
    ("words", "file", "out"),
    [
        ("study factors --factor code_noise --duration 120 --quiet --out {desk}", "factors.json", True),
        ("report {run} --out {desk}/page.html", "page.html", True),
        ("report {run} {run} --out {desk}/page.html", "page.html", True),
        ("icd html --out {desk}/page.html", "page.html", True),
        ("schema vehicle --out {desk}", "vehicle.schema.json", False),
        ("convert {run} {desk}/a.asc", "a.asc", False),
        ("export oem {run} --truth --out {desk}", "soyuz.oem", False),
    ],
    ids=lambda value: value.split()[0] if isinstance(value, str) and " " in value else "",
)
def test_a_command_overwrites_only_with_force(words, file, out, run, desk, capsys):
    (desk / file).write_text(MINE)
    argv = [word.format(run=run, desk=desk) for word in words.split()]
    assert main(argv) == 2
    said = capsys.readouterr().err
    assert (desk / file).read_text() == MINE
    assert said.count("\n") == 1 and "exists" in said and "--force overwrites" in said
    assert ("--out" in said) == out
    assert main([*argv, "--force"]) == 0
    assert MINE not in (desk / file).read_text()


def test_a_schema_of_this_version_may_be_written_again(desk):
    for _ in range(2):
        assert main(["schema", "--out", str(desk / "schemas")]) == 0


def test_a_study_has_a_folder_of_its_own_where_none_is_named(desk, capsys):
    for _ in range(2):
        assert main("study factors --factor code_noise --duration 120 --quiet".split()) == 0
    folders = list((desk / "runs").iterdir())
    assert len(folders) == 2 and all(folder.name.startswith("study-factors-") for folder in folders)


def test_folders_and_files_that_are_free(tmp_path):
    check_new_folder(tmp_path)
    check_new_folder(tmp_path / "new")
    check_new_file(tmp_path / "new.txt", force=False)
    make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()


def test_what_is_taken_is_named(tmp_path):
    taken = [tmp_path / name for name in ("one", "two", "free")]
    for path in taken[:2]:
        path.touch()
    for check, line in (
        (lambda: check_new_folder(tmp_path, "--report"), f"--report {tmp_path}: exists and is not an empty"),
        (lambda: check_new_folder(taken[0], forceable=True), "one: exists and is not an empty folder$"),
        (lambda: check_new_file(tmp_path, force=True), "is a folder; name a file"),
        (lambda: check_new_file(tmp_path / "no" / "file", force=True), "no such folder .*no$"),
        (lambda: check_new_files(taken, force=False), "one and 1 more: exists; --force overwrites"),
        (lambda: make_folder(taken[0]), "--out .*one: is a file; name a folder"),
        (lambda: make_folder(taken[0] / "below"), "--out .*one/below: cannot be made: Not a directory"),
    ):
        with pytest.raises(Mistake, match=line):
            check()
    check_new_files(taken, force=True)
