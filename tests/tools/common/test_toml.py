"""TOML that is written, read back."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.emulator.config import scenario as scenarios
from gnss_hil.tools.common import toml

NAMES = st.text(st.characters(codec="utf-8"), min_size=1, max_size=8)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**62), 2**62) | st.floats(allow_nan=False, allow_infinity=False) | NAMES,
    lambda v: st.lists(v, max_size=3) | st.dictionaries(NAMES, v, max_size=3),
    max_leaves=12,
)


@pytest.mark.verifies(
    "tools/common/toml.py",
    what="Resolved scenarios as TOML",
    by="Python's tomllib reads any document back, by hypothesis",
    status="validated",
)
@given(st.dictionaries(NAMES, VALUES, max_size=4))
def test_toml_reads_back_what_was_written(document):
    assert tomllib.loads(toml.dumps(document)) == document


@pytest.mark.parametrize("name", scenarios.shipped())
def test_a_resolved_scenario_is_the_same_scenario(name):
    path = scenarios.shipped()[name]
    scenario = scenarios.parse(scenarios.read(path), str(path))
    again = tomllib.loads(toml.dumps(scenario.model_dump(mode="json", exclude_none=True)))
    assert scenarios.parse(again, "again") == scenario
