"""docs/automate.md is done as it says: its program runs, its test passes, what it names is there."""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gnss_hil
from gnss_hil.tools.results.checks import CHECKS
from gnss_hil.tools.results.outages import REASONS
from tests.support.programs import ROOT

PAGE = ROOT / "docs" / "automate.md"
TEXT = PAGE.read_text("utf-8")
BLOCKS = dict(re.findall(r"^```python (\S+)\n(.*?)^```$", TEXT, re.M | re.S))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in BLOCKS.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.slow
def test_the_program_runs(folder):
    done = subprocess.run(
        [sys.executable, "study.py"], cwd=folder, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    shares = [
        re.fullmatch(r"(\w+) +([\d.]+)% fixes +([\d.]+) satellites +([\d.]+) m", line) for line in lines[:2]
    ]
    assert [match[1] for match in shares] == ["patent", "prototype"]
    assert float(shares[0][3]) > float(shares[1][3])
    assert "position_error_m" in done.stdout


@pytest.mark.slow
def test_the_test_passes(folder):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "gnss_hil.tools.pytest_plugin", "test_receiver.py"],
        cwd=folder, capture_output=True, text=True, env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
    )  # fmt: skip
    assert "3 passed" in done.stdout, done.stdout


def table(heading: str) -> list[str]:
    """Names in the first column of the table under a heading row."""
    rows = TEXT[TEXT.index(f"| {heading} |") :].split("\n\n")[0].splitlines()[2:]
    return [name for row in rows for name in re.findall(r"`(\w+)", row.split(" | ")[0])]


def test_what_it_names_of_a_run_is_there_and_nothing_is_left_out():
    public = {name for name in vars(gnss_hil.Run) if not name.startswith("_")} | {
        name for name in gnss_hil.Run.__dataclass_fields__
    }
    assert set(table("of a `Run`")) == public - {"read", "craft"}


def test_arguments_that_it_names_are_there():
    parameters = inspect.signature(gnss_hil.run).parameters
    assert set(table("argument")) <= set(parameters)
    assert "gnss_hil.Run.read" in TEXT


def test_the_fixture_takes_what_the_function_takes():
    own, *taken = inspect.signature(gnss_hil.Bench.run).parameters.values()
    assert own.name == "self"
    theirs = inspect.signature(gnss_hil.run).parameters.values()
    assert [(p.name, p.kind) for p in taken] == [(p.name, p.kind) for p in theirs]
    assert [p.name for p, q in zip(taken, theirs, strict=True) if p != q] == ["report"]


def test_checks_are_named_as_they_are():
    (said,) = re.findall(r"\*\*Checks\*\* by name.*?\n\n", TEXT, re.S)
    named = {name.lower() for name in CHECKS if name not in REASONS}
    assert named <= set(re.findall(r"`(\w+)`", said))


def test_every_parameter_is_described_with_its_name():
    words = set(re.findall(r"\w+", gnss_hil.run.__doc__))
    assert set(inspect.signature(gnss_hil.run).parameters) <= words
