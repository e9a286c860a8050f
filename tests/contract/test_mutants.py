"""The rows of mutants name code and tests that are there; `make mutants` says whether these catch them."""

from __future__ import annotations

import pytest

from tests.mutants.__main__ import BROKEN, KILLED, SURVIVED, verdict_on
from tests.mutants.table import Mutant, faults, rows
from tests.mutants.workspace import made


def test_rows_name_code_and_tests_that_are_there():
    assert list(faults(rows())) == []


ROW = Mutant(
    id="a", file="dbc/common/gpstime.py", old="NS_PER_S = 1_000_000_000", new="NS_PER_S = 1_000_000",
    tests=("tests/dbc/common/test_gpstime.py::test_weeks",), why="of this test",
)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"old": "no such text"}, "stands 0 times"),
        ({"old": "_ns"}, "times in"),
        ({"new": ROW.old}, "is the old one"),
        ({"file": "dbc/no.py"}, "no file dbc/no.py"),
        ({"file": "docs/can.md"}, "is in none of"),
        ({"tests": ("tests/no.py::test_no",)}, "no file tests/no.py"),
        ({"tests": ("tests/dbc/common/test_gpstime.py::test_no",)}, "no test 'test_no'"),
        ({"tests": ("tests/dbc/common/test_gpstime.py",)}, "no test ''"),
    ],
)
def test_a_row_that_says_nothing_is_told(change, fault):
    (said, *_) = faults([ROW.model_copy(update=change)])
    assert said.startswith("a: ") and fault in said


def test_a_name_is_given_once():
    assert list(faults([ROW, ROW])) == ["a: there are two of this name"]


def test_a_mutant_is_caught_survives_or_is_no_program(tmp_path):
    workspace = made(tmp_path / "copy")
    harmless = ROW.model_copy(update={"new": "NS_PER_S = 1_000_000_000 * 1"})
    broken = ROW.model_copy(update={"new": "NS_PER_S = ("})
    verdicts = [verdict_on(workspace, mutant)[0] for mutant in (ROW, harmless, broken)]
    assert verdicts == [KILLED, SURVIVED, BROKEN]
