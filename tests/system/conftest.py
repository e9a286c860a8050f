"""Runs that several tests look at."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.report_pages import played
from tests.support.runs import DURATION

pytest.register_assert_rewrite("tests.support.mistakes")


@pytest.fixture(scope="session")
def inline(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "inline"
    assert main(["run", "--bus", "inline", "--duration", DURATION, "--out", str(folder), "--quiet"]) == 0
    return folder


@pytest.fixture(scope="session")
def patent(tmp_path_factory) -> Path:
    """A run with its page."""
    return played(tmp_path_factory.mktemp("report") / "patent")


@pytest.fixture(scope="session")
def prototype(tmp_path_factory) -> Path:
    """The same by another policy."""
    return played(tmp_path_factory.mktemp("report") / "prototype", "--policy", "prototype")


@pytest.fixture
def copied(patent, tmp_path) -> Path:
    """A copy of the first, to be spoiled."""
    return Path(shutil.copytree(patent, tmp_path / "copy"))
