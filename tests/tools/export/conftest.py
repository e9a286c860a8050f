"""One run for all tests of exports."""

from __future__ import annotations

import pytest

from tests.tools.export.runs import played
from tools.export import heard


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    return played(tmp_path_factory.mktemp("export") / "run", "--off", "all")


@pytest.fixture(scope="session")
def told(run):
    """Scenario and craft of the run, as its bus told them."""
    scenario, (craft,) = heard.read(run)
    return scenario, craft
