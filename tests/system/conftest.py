"""Runs that several tests look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.runs import DURATION

pytest.register_assert_rewrite("tests.support.mistakes")


@pytest.fixture(scope="session")
def inline(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "inline"
    assert main(["run", "--bus", "inline", "--duration", DURATION, "--out", str(folder), "--quiet"]) == 0
    return folder
