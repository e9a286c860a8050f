"""Clocks and time offsets: what measurements can tell apart, by the rank of the design."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.common import systems
from gnss_hil.flightsw.estimation import clocks
from gnss_hil.flightsw.estimation.clocks import ReceiverClocks, clock_columns, estimable_offsets, mean_clocks

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/clocks.py",
    what="Clock domains and time offsets of systems",
    by="rank of the design by NumPy over random domains and systems",
    status="validated",
)

GPS, GLONASS, GALILEO = (systems.SYSTEMS[name].value for name in ("gps", "glonass", "galileo"))
ITEM = systems.SYSTEMS["glonass"].time_offset_item

PAIRS = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 5)), min_size=1, max_size=14)


@given(PAIRS)
@settings(max_examples=200, deadline=None)
def test_as_many_unknowns_as_the_measurements_tell_apart(pairs):
    """Any domains and systems: the columns chosen are independent, and none more would be."""
    domain, system = np.array(pairs).T
    every = np.concatenate((domain[:, None] == np.arange(5), system[:, None] == np.arange(1, 6)), axis=1)
    chosen = sorted(set(domain.tolist()))
    offsets = estimable_offsets(pairs)
    own = np.concatenate((domain[:, None] == chosen, system[:, None] == offsets), axis=1)
    rank = np.linalg.matrix_rank(own.astype(float))
    assert rank == own.shape[1] == np.linalg.matrix_rank(every.astype(float))
    assert GPS not in offsets


def test_items_are_domains_and_the_contracts_offsets():
    domain, system = np.array([2, 2, 5, 5]), np.array([GPS, GLONASS, GLONASS, GLONASS])
    items, columns = clock_columns(domain, system)
    assert items == (2, 5, ITEM) and [clocks.is_offset(item) for item in items] == [False, False, True]
    assert columns.tolist() == [[1, 0, 0], [1, 0, 1], [0, 1, 1], [0, 1, 1]]
    items, _ = clock_columns(np.array([0, 1]), np.array([GPS, GLONASS]))
    assert items == (0, 1), "no domain hears both: the clock of 1 contains the offset"


def test_without_the_reference_the_clocks_are_by_the_first_system():
    assert estimable_offsets([(0, GLONASS), (0, GALILEO)]) == [GALILEO]
    assert estimable_offsets([(0, GPS), (1, GLONASS), (1, GALILEO)]) == [GALILEO]
    assert estimable_offsets([(0, GPS), (0, GLONASS), (1, GALILEO), (1, GLONASS)]) == [GLONASS, GALILEO]
    assert clocks.base_system([GALILEO, GPS, GLONASS]) == GPS


def test_the_mean_counts_offsets_from_the_reference():
    """Receiver 1 is by GLONASS: its clock is later by the offset, its Galileo offset is from there."""
    other = 9
    mean = mean_clocks(
        [
            ReceiverClocks((0, ITEM), np.array([100.0, 30.0]), frozenset({GPS, GLONASS})),
            ReceiverClocks((0, other), np.array([130.0, -12.0]), frozenset({GLONASS, GALILEO})),
        ]
    )
    assert mean[0] == (0, ITEM, other)
    assert mean[1].tolist() == [100.0, 30.0, 18.0]
