"""The flight software in C, and a run of ours to hold it against."""

from __future__ import annotations

from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.feeder import recorded
from tests.support.fsw_c import EPOCHS, build, without_figures


@pytest.fixture(scope="session")
def fsw(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fsw_c")
    build(folder)
    return folder / "fsw"


@pytest.fixture(scope="session")
def sanitized(fsw) -> Path:
    build(fsw.parent, "sanitize")
    return fsw.parent / "sanitize" / "fsw"


@pytest.fixture(scope="session")
def ours(tmp_path_factory) -> Path:
    """A run of our own flight software, which is told no more of the receivers than the one in C goes by."""
    folder = tmp_path_factory.mktemp("runs")
    soyuz = without_figures(folder)
    words = ["run", str(soyuz), "--bus", "inline", "--duration", str(EPOCHS), "--quiet"]
    assert main([*words, "--out", str(folder / "ours")]) == 0
    return folder / "ours"


@pytest.fixture(scope="session")
def epochs(ours) -> list:
    return recorded(ours / "bus.log")
