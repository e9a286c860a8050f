"""One run for all tests of exports."""

from __future__ import annotations

import pytest

from gnss_hil.tools.export import run_data
from tests.support.exported import played


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    return played(tmp_path_factory.mktemp("export") / "run", "--off", "all")


@pytest.fixture(scope="session")
def decoded(run):
    """Scenario and craft of the run, as its bus has them."""
    scenario, (craft,) = run_data.read(run)
    return scenario, craft
