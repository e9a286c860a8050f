"""The rows of mutants, and what must hold of a row before it is worth playing."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

ROOT = Path(__file__).resolve().parents[2]
TABLES = Path(__file__).parent
PACKAGES = ("dbc", "emulator", "flightsw", "tools")


class Mutant(BaseModel):
    """One change of one file, and the tests of which at least one must fail for it.

    id      its name, unique over all tables
    file    the changed file, from the root of the checkout
    old     text that stands in it exactly once;  new: what stands there instead
    tests   pytest node ids, `tests/.../test_x.py::test_y`
    why     what a user would suffer from the mutant
    hangs   why the mutant may hang instead of failing, if it may
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$")]
    file: str
    old: Annotated[str, Field(min_length=1)]
    new: str
    tests: Annotated[tuple[str, ...], Field(min_length=1)]
    why: Annotated[str, Field(min_length=1)]
    hangs: str = ""

    @property
    def package(self) -> str:
        return self.file.split("/")[0]


def rows() -> tuple[Mutant, ...]:
    """All mutants, by file of rows and place in it."""
    return tuple(
        Mutant.model_validate(row)
        for path in sorted(TABLES.glob("*.toml"))
        if path.name != SCORES.name
        for row in tomllib.loads(path.read_text("utf-8")).get("mutant", ())
    )


SCORES = TABLES / "scores.toml"
"""Killed and played mutants of each package, as of the last whole run."""


def faults(mutants: Sequence[Mutant], root: Path = ROOT) -> Iterator[str]:
    """What is wrong with rows, a line each: names twice, text that is not there once, tests that are not."""
    seen: set[str] = set()
    for mutant in mutants:
        if mutant.id in seen:
            yield f"{mutant.id}: there are two of this name"
        seen.add(mutant.id)
        if mutant.package not in PACKAGES:
            yield f"{mutant.id}: {mutant.file} is in none of {', '.join(PACKAGES)}"
        yield from (f"{mutant.id}: {fault}" for fault in _faults_of(mutant, root))


def _faults_of(mutant: Mutant, root: Path) -> Iterator[str]:
    path = root / mutant.file
    if not path.is_file():
        yield f"no file {mutant.file}"
    elif (count := path.read_text("utf-8").count(mutant.old)) != 1:
        yield f"the old text stands {count} times in {mutant.file}, not once: {mutant.old!r}"
    if mutant.old == mutant.new:
        yield "the new text is the old one"
    for test in mutant.tests:
        file, _, name = test.partition("::")
        if not (root / file).is_file():
            yield f"no file {file}"
        elif name.split("[")[0] not in _tests_of(root / file):
            yield f"no test {name!r} in {file}"


@cache
def _tests_of(path: Path) -> frozenset[str]:
    """Names of a file's test functions, those of classes as `Class::test`."""
    names = set()
    for node in ast.parse(path.read_text("utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.ClassDef):
            names |= {f"{node.name}::{item.name}" for item in node.body if isinstance(item, ast.FunctionDef)}
    return frozenset(name for name in names if name.split("::")[-1].startswith("test"))
