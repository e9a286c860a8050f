"""VERIFICATION.md is complete and true: every module is in it, every file and test it names exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("dbc", "emulator", "flightsw", "tools")
HEAD = ["what", "where", "status", "judged by", "test"]
STATUS = ("validated", "modelled")

NOTHING_TO_JUDGE = {
    "dbc/common/arrays.py": "names of array types",
    "tools/packaging/": "how the package is built: the tests of installs see it",
    "tools/command_line/main.py": "finds the command and turns mistakes into a line and a status",
    "tools/commands/": "arguments in, messages out: what the commands call has rows",
    "tools/common/errors.py": "two kinds of mistake by name",
    "tools/live/display.py": "the face of a display, without a body",
    "tools/common/ticker.py": "a line that says how far a long piece of work is",
    "tools/monitor/discovery.py": "lists sockets in a folder",
}
"""Folder or file -> why it has no row. A package's `__init__.py` that imports and no more has none either."""


def rows_of(text: str) -> list[list[str]]:
    """All rows of all tables, cells stripped, without heads and rules; ValueError for one of another form."""
    lines = [line.strip() for line in text.splitlines() if line.strip().startswith("|")]
    rows = [[cell.strip() for cell in line[1:].removesuffix("|").split("|")] for line in lines]
    rows = [row for row in rows if row != HEAD and set("".join(row)) != {"-"}]
    for row in rows:
        if len(row) != len(HEAD) or row[2] not in STATUS or not all(row[:4]):
            raise ValueError(f"no row of VERIFICATION.md: {row}")
    return rows


ROWS = rows_of((ROOT / "VERIFICATION.md").read_text("utf-8"))
NAMED = {name for row in ROWS for name in re.findall(r"`([^`]+)`", row[1])}


def does_something(path: Path) -> bool:
    """Whether a module is more than a docstring, imports, and the list of what a package offers."""
    return not all(
        isinstance(node, (ast.Import, ast.ImportFrom))
        or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))
        or (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__")
        for node in ast.parse(path.read_text("utf-8")).body
    )


MODULES = [
    path.relative_to(ROOT).as_posix()
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*.py"))
    if does_something(path)
]


@pytest.mark.parametrize("module", MODULES)
def test_every_module_has_a_row_or_nothing_to_judge(module):
    exempt = any(module.startswith(place) for place in NOTHING_TO_JUDGE)
    assert (module in NAMED) != exempt, f"{module}: needs a row in VERIFICATION.md, or a reason, not both"


@pytest.mark.parametrize("place", NOTHING_TO_JUDGE)
def test_every_exemption_is_of_something(place):
    assert any(module.startswith(place) for module in MODULES)


def test_modules_are_found_in_every_folder():
    assert {"emulator/signal/ionosphere/slant.py", "dbc/bus/hub.py", "tools/report/sky_plot.py"} <= set(
        MODULES
    )
    assert "tools/report/__init__.py" not in MODULES


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_every_row_names_what_exists(row):
    _, where, status, _, test = row
    places = re.findall(r"`([^`]+)`", where)
    assert places
    for place in places:
        assert (ROOT / place).exists(), place
    named = re.findall(r"`(tests/[^`:]*test_\w+\.py)(?:::(test_\w+))?`", test)
    assert len(named) == test.count("`") / 2, f"not the name of a test: {test}"
    assert named or status == "modelled"
    for file, function in named:
        text = (ROOT / file).read_text("utf-8")
        assert not function or f"def {function}(" in text, f"{file}::{function}"


def test_no_two_rows_have_one_name():
    names = [row[0] for row in ROWS]
    assert sorted(set(names)) == sorted(names)


@pytest.mark.parametrize(
    "line",
    [
        "| Sun | `a.py` | checked | a book | `tests/test_a.py` |",
        "| Sun | `a.py` | Validated | a book | `tests/test_a.py` |",
        "| Sun | `a.py` | validated | a book |",
        "| Sun | `a.py` | validated | | `tests/test_a.py` |",
        "  | Sun | `a.py` | to do | a book | `tests/test_a.py` |",
        "| Sun | `a.py` | validated | half | a book | `tests/test_a.py` |",
    ],
)
def test_a_row_of_another_form_is_not_passed_over(line):
    head = "| what | where | status | judged by | test |\n|---|---|---|---|---|\n"
    good = "| Moon | `b.py` | modelled | our choice | |"
    assert len(rows_of(head + good)) == 1
    with pytest.raises(ValueError, match="Sun"):
        rows_of(f"{head}{good}\n{line}\n")


def test_more_than_two_thirds_are_validated():
    validated = sum(row[2] == "validated" for row in ROWS)
    print(f"{validated} of {len(ROWS)} rows are validated: {validated / len(ROWS):.1%}")
    assert validated > 2 / 3 * len(ROWS)
