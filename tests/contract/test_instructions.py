"""What an epoch costs, in instructions: counted by valgrind, so the same whatever else the machine does."""

from __future__ import annotations

import pytest

from tests.benchmarks import instructions
from tests.support.outside import program


@pytest.mark.slow(seconds=35)
def test_an_epoch_costs_no_more_than_its_limit():
    program("valgrind", "valgrind", "VALGRIND")
    found = instructions.measured()
    print(instructions.table(found))
    assert instructions.too_many(found) == []


def test_what_is_beyond_limit_and_margin_is_named():
    at = dict(instructions.LIMITS)
    assert instructions.too_many(at) == []
    assert instructions.too_many(at | {"flight": 1.01 * instructions.MARGIN * at["flight"]}) == ["flight"]
