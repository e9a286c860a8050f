"""Every module is judged by a test that says so, or has nothing to judge; see tests/verification."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.verification.page import PACKAGES, pages, scores
from tests.verification.rows import rows

ROOT = Path(__file__).parents[2]

NOTHING_TO_JUDGE = {
    "dbc/common/arrays.py": "names of array types",
    "dbc/common/limits.py": "two numbers of the contract",
    "tools/packaging/": "how the package is built: the tests of installs see it",
    "tools/command_line/main.py": "finds the command and turns mistakes into a line and a status",
    "tools/commands/": "arguments in, messages out: what the commands call has rows",
    "tools/common/errors.py": "two kinds of mistake by name",
    "tools/live/display.py": "the face of a display, without a body",
    "tools/common/ticker.py": "a line that says how far a long piece of work is",
    "tools/monitor/discovery.py": "lists sockets in a folder",
}
"""Folder or file -> why it has no row. A package's `__init__.py` that imports and no more has none either."""


ROWS = rows()
NAMED = {place for row in ROWS for place in row.where}


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
    assert (module in NAMED) != exempt, (
        f"{module}: name it in a marker `verifies` on the test that judges it (see tests/verification), or "
        "give a reason here, not both"
    )


@pytest.mark.parametrize("place", NOTHING_TO_JUDGE)
def test_every_exemption_is_of_something(place):
    assert any(module.startswith(place) for module in MODULES)


def test_modules_are_found_in_every_folder():
    assert {"emulator/signal/ionosphere/slant.py", "dbc/bus/hub.py", "tools/report/sky_plot.py"} <= set(
        MODULES
    )
    assert "tools/report/__init__.py" not in MODULES


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.what)
def test_every_row_names_files_that_exist(row):
    assert [place for place in row.where if not (ROOT / place).exists()] == [], row.tests


def test_no_row_is_validated_without_a_test():
    assert all(row.tests or row.status == "modelled" for row in ROWS)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_row_is_on_the_page_of_its_packages(package):
    lines = pages()[f"docs/verification/{package}.md"].splitlines()
    for row in ROWS:
        if any(place.startswith(f"{package}/") for place in row.where):
            (line,) = (one for one in lines if one.startswith(f"| {row.what} |"))
            assert row.status in line and all(test.split("::")[0] in line for test in row.tests)


def test_scores_of_mutants_are_beside_the_rows(tmp_path):
    path = tmp_path / "scores.toml"
    assert scores(path) == {}
    path.write_text("[dbc]\nkilled = 11\nof = 12\n")
    assert scores(path) == {"dbc": "11 of 12"}
