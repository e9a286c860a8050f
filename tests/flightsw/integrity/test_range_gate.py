"""Ranges that no orbit explains: which they are, and what becomes of an epoch with one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.integrity.exclusion import Rules
from gnss_hil.flightsw.integrity.range_gate import NEAR_M, WIDEST_M, plausible
from gnss_hil.flightsw.records.solution import NoFix
from tests.support import synthetic_epochs as s
from tests.support.fixes import GEO, LEO, MEO, SKY, craft, errors, fix_of, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/range_gate.py",
    what="Ranges that no orbit explains",
    by="ranges of crafts from LEO to GEO, all kept; ranges at the field's ends, left out and the fix right",
    status="validated",
)

TOP_M, BOTTOM_M = 2**42 * 1e-4 - 1e-4, 0.0
ONE_CLOCK = np.zeros(5, int)


@pytest.mark.parametrize("orbit", [LEO, MEO, GEO], ids=["LEO", "MEO", "GEO"])
def test_every_range_to_a_satellite_in_sight_is_kept(orbit):
    """Whatever the receiver's clock: it is in all of them."""
    c = craft(orbit, clock_s=(0.3,))
    m = measurements(s.observe(c, in_view(c, 48), SKY, rates=False))
    value_m = m.pseudorange_m + m.clock_m
    assert len(m) > 20 and plausible(value_m, None, c.domain[m.receiver]).all()
    wrong_m = value_m + 1.3e8 * (np.arange(len(m)) == 3)
    assert not plausible(wrong_m, None, c.domain[m.receiver])[3]


@pytest.mark.parametrize("expected_m", [None, np.arange(5) * 1e7])
def test_near_is_within_the_limit_of_the_middle(expected_m):
    limit_m = WIDEST_M if expected_m is None else NEAR_M
    others = np.zeros(5) if expected_m is None else expected_m
    for off, kept in ((0.99, True), (-0.99, True), (1.01, False), (-1.01, False)):
        value_m = 3e8 + others + off * limit_m * (np.arange(5) == 2)
        assert plausible(value_m, expected_m, ONE_CLOCK).tolist() == [True, True, kept, True, True]


def test_each_clock_is_by_itself_and_two_ranges_have_no_middle():
    value_m = np.array([0.0, 1.0, 5e8, 9e8, 9e8, 9e8, 1e8, 4e8])
    clocks = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    assert plausible(value_m, None, clocks).tolist() == [True, True, False, *[True] * 5]


@pytest.mark.parametrize("wrong_m", [TOP_M, BOTTOM_M])
@pytest.mark.parametrize("warm", [True, False])
def test_a_range_at_an_end_of_its_field_is_left_out(wrong_m, warm):
    c = craft()
    m = measurements(s.observe(c, in_view(c, 10), SKY))
    start = s.truth_ecef(c)[0] + 50.0 if warm else None
    for row in range(10):
        fix = fix_of(
            c, replace(m, pseudorange_m=np.where(np.arange(10) == row, wrong_m, m.pseudorange_m)), start
        )
        assert np.flatnonzero(~fix.used).tolist() == [row] and errors(c, fix)[0] < 1e-4


def test_two_ranges_at_the_top_of_their_field_are_left_out_together():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 12), SKY))
    m.pseudorange_m[[2, 7]] = TOP_M
    fix = fix_of(c, m)
    assert np.flatnonzero(~fix.used).tolist() == [2, 7] and errors(c, fix)[0] < 1e-4


def test_what_is_left_after_the_gate_must_check_itself():
    """Of six ranges of two systems five are left for five unknowns: they would agree whatever they are."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, 6, sats=[1, *range(65, 89)]), SKY))
    m.pseudorange_m[1] = TOP_M
    found = fix_of(c, m, rules=Rules(exclude=1))
    assert isinstance(found, NoFix), found
