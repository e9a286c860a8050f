"""The rows, collected from the sources of the tests: nothing is imported or run."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
EXTRA = Path(__file__).parent / "extra.toml"
STATUS = ("validated", "modelled")
MARKER = "pytest.mark.verifies"


class Unclear(ValueError):
    """A marker or a row of extra.toml that is not as it must be."""


@dataclass(frozen=True, slots=True)
class Row:
    """Something that is judged.

    what    its name, unique
    where   files, relative to the repository
    by      who or what judges it
    status  validated: by a number or an implementation that is not ours, or by independent mathematics;
            modelled: our choice
    tests   node ids, `tests/test_a.py` or `tests/test_a.py::test_b`
    """

    what: str
    where: tuple[str, ...]
    by: str
    status: str
    tests: tuple[str, ...] = ()


@cache
def rows() -> tuple[Row, ...]:
    """All rows, in the order of the files that judge them."""
    marked = [mark for path in sorted(TESTS.rglob("test_*.py")) for mark in marks(path)]
    return joined([*marked, *extra(EXTRA)])


def extra(path: Path) -> list[Row]:
    """Rows whose judge is no test."""
    table = tomllib.loads(path.read_text("utf-8"))
    return [_checked(Row(**{**row, "where": tuple(row["where"])}), str(path)) for row in table.get("row", ())]


def joined(marked: list[Row]) -> tuple[Row, ...]:
    """Rows with all their tests; Unclear if two have a name, or one is named that no marker describes."""
    found: dict[str, Row] = {}
    for row in marked:
        if row.where and row.what in found:
            raise Unclear(f"'{row.what}' is described twice, in {found[row.what].tests} and {row.tests}")
        if row.where:
            found[row.what] = row
    for row in marked:
        if row.where:
            continue
        if row.what not in found:
            raise Unclear(f"{', '.join(row.tests)}: no marker describes '{row.what}'")
        first = found[row.what]
        found[row.what] = replace(first, tests=(*first.tests, *row.tests))
    return tuple(found.values())


def marks(path: Path, root: Path = ROOT) -> list[Row]:
    """The markers of a file of tests, as rows; those without files add a test to another row."""
    tree = ast.parse(path.read_text("utf-8"))
    file = path.relative_to(root).as_posix()
    return [_row(call, node) for call, node in _calls(tree, file)]


def _calls(tree: ast.Module, file: str) -> Iterator[tuple[ast.Call, str]]:
    """Calls of the marker with the node id that each belongs to."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark":
            yield from ((call, file) for call in _among(node.value))
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            for decorator in node.decorator_list:
                yield from ((call, f"{file}::{node.name}") for call in _among(decorator))


def _among(node: ast.expr) -> Iterator[ast.Call]:
    """The marker's calls in an expression: itself, or in a list of marks."""
    for each in node.elts if isinstance(node, ast.List | ast.Tuple) else [node]:
        if isinstance(each, ast.Call) and ast.unparse(each.func) == MARKER:
            yield each


def _row(call: ast.Call, test: str) -> Row:
    try:
        where = tuple(ast.literal_eval(argument) for argument in call.args)
        words = {str(word.arg): ast.literal_eval(word.value) for word in call.keywords}
    except ValueError:
        raise Unclear(f"{test}: the marker verifies takes plain strings") from None
    if not where and set(words) == {"what"}:
        return Row(words["what"], (), "", "", (test,))
    if not where or set(words) != {"what", "by", "status"}:
        raise Unclear(f"{test}: verifies takes files, what, by and status; or what alone for a further test")
    return _checked(Row(words["what"], where, words["by"], words["status"], (test,)), test)


def _checked(row: Row, origin: str) -> Row:
    if row.status not in STATUS:
        raise Unclear(f"{origin}: status '{row.status}' of '{row.what}'; allowed are {' and '.join(STATUS)}")
    if not row.what or not row.by:
        raise Unclear(f"{origin}: a row says what it is and who judges it")
    return row
