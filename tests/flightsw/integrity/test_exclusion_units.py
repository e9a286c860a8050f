"""What is excluded together, and beside what was known before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.integrity.exclusion import (
    BEFORE,
    MOST_SETS,
    OF_SATELLITES,
    Kept,
    Refusal,
    Rules,
    Units,
    exclude,
    isolate,
)
from gnss_hil.flightsw.records.solution import NoFix
from tests.flightsw.integrity.test_exclusion import offered
from tests.support import synthetic_epochs as s
from tests.support.fits import drawn_design, trial_of
from tests.support.fixes import SKY, craft, errors, fix_of, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/exclusion.py",
    what="Satellites and receivers excluded",
    by="least squares of measurements and of what was known before by NumPy lstsq",
    status="validated",
)


def receivers_off(metres, count=24, which=1):
    c = craft()
    m = measurements(s.observe(c, in_view(c, count), SKY))
    return c, replace(m, pseudorange_m=m.pseudorange_m + metres * (m.receiver == which))


@pytest.mark.parametrize("metres", [30.0, -100.0, 3e5])
def test_a_receiver_that_lies_is_excluded(metres):
    c, m = receivers_off(metres)
    fix = fix_of(c, m)
    assert np.array_equal(fix.used, m.receiver != 1) and errors(c, fix)[0] < 1e-4
    assert fix_of(c, m, rules=Rules(receivers=0)) is NoFix.INCONSISTENT_RANGES


def test_two_receivers_are_excluded_only_if_the_rules_say_so():
    c, m = receivers_off(3000.0, count=40)
    m = replace(m, pseudorange_m=m.pseudorange_m - 800.0 * (m.receiver == 3))
    assert fix_of(c, m) is NoFix.INCONSISTENT_RANGES


def test_a_receiver_and_a_satellite_of_another_one():
    c, m = receivers_off(200.0)
    m = replace(m, pseudorange_m=m.pseudorange_m + 150.0 * (np.arange(len(m)) == 2))
    fix = fix_of(c, m)
    assert np.flatnonzero(~fix.used).tolist() == sorted({2, *np.flatnonzero(m.receiver == 1).tolist()})


def test_two_satellites_that_hide_each_other_are_found_together():
    """Neither stands out: without the one, the other is as good as its neighbours."""
    c = craft()
    for first, second in ((0, 3), (2, 8), (7, 11)):
        m = offered(c, 14, {first: 60.0, second: 60.0})
        assert fix_of(c, m, rules=Rules(1, 0)) is NoFix.INCONSISTENT_RANGES
        fix = fix_of(c, m)
        assert np.flatnonzero(~fix.used).tolist() == [first, second] and errors(c, fix)[0] < 1e-4


@pytest.mark.parametrize(("count", "most"), [(11, 1), (12, 2), (17, 2), (18, 3)])
def test_one_of_so_many_satellites_at_most_is_excluded(count, most):
    """Two or three are wrong by kilometres, and the option allows nine."""
    c = craft()
    biases_m = {1: 5000.0, 4: -3000.0, 6: 9000.0}
    assert count // OF_SATELLITES == most
    for wrong in (1, 2, 3):
        m = offered(c, count, dict(list(biases_m.items())[:wrong]))
        found = fix_of(c, m, rules=Rules(9, 0))
        if wrong > most:
            assert found is NoFix.INCONSISTENT_RANGES
        else:
            assert np.count_nonzero(~found.used) == wrong


def test_of_more_sets_than_are_looked_at_none_stands_out():
    """Three of 28 are looked for, three of 27 are few enough: 3,276 and 2,925 sets."""
    rng = np.random.default_rng(7)
    for n, looked_at in ((27, True), (28, False)):
        y = rng.normal(size=n)
        y[[3, 8, 20]] += 50, -70, 60
        found = isolate(np.arange(n), trial_of(drawn_design(rng, n), y, np.ones(n)), 3)
        assert MOST_SETS == 3000 and found == ({3, 8, 20} if looked_at else None)


def test_faults_of_their_own_must_leave_more_to_test_than_they_take():
    """A receiver's four ranges, of which each may be wrong by something else: where the others have less than
    five to spare, what is left would agree by chance."""
    rng = np.random.default_rng(3)
    for others, stands_out in ((6, False), (8, False), (9, True)):
        receiver = np.repeat([0, 1, 2], (4, others // 2, others - others // 2))
        y = rng.normal(size=len(receiver)) + 1000.0 * rng.normal(size=len(receiver)) * (receiver == 0)
        trial = trial_of(drawn_design(rng, len(receiver)), y, np.ones(len(receiver)))
        assert isolate(receiver, trial) == {0}
        assert isolate(receiver, trial, several=True) == ({0} if stands_out else None)


@pytest.mark.parametrize("size", [1, 2])
def test_what_was_known_before_is_never_excluded(size):
    """A craft a kilometre from where it should be: it stands alone against all of them, not among several."""
    rng = np.random.default_rng(4)
    design, weight = drawn_design(rng, 12), np.ones(12)
    y = rng.normal(size=12)
    trial = trial_of(design, y, weight, np.eye(3), np.array([1000.0, 0, 0]))
    units = Units(np.arange(12), np.arange(12) % 4)
    assert isolate(units.sat, trial) == {BEFORE}
    two = trial_of(design, y + 1000.0 * (units.sat == 3), weight, np.eye(3), np.array([1000.0, 0, 0]))
    assert BEFORE not in (isolate(units.sat, two, 2) or ()), "a satellite, and what was known before"
    refits = []

    def refit(rows):
        refits.append(rows)
        return trial_of(design[rows], y[rows], weight[rows], np.eye(3), np.array([1000.0, 0, 0]))

    assert exclude(trial, refit, units, Rules(size, 1)) is Refusal.AGAINST_BEFORE
    assert all(len(rows) < 12 for rows in refits)
    wrong = trial_of(design, y + 1000.0 * rng.normal(size=12), weight, np.eye(3), np.zeros(3))
    assert exclude(wrong, lambda rows: None, units, Rules()) is Refusal.INCONSISTENT


def test_a_satellite_is_excluded_beside_what_was_known_before():
    """Of five, which could not be told apart without it."""
    rng = np.random.default_rng(5)
    design, weight = drawn_design(rng, 5), np.ones(5)
    y = rng.normal(size=5) + 500.0 * (np.arange(5) == 3)
    units = Units(np.arange(5), np.arange(5))

    def refit(rows):
        return trial_of(design[rows], y[rows], weight[rows], np.eye(3), rng.normal(size=3))

    kept = exclude(refit(np.arange(5)), refit, units, Rules())
    assert isinstance(kept, Kept) and kept.rows.tolist() == [0, 1, 2, 4]
    alone = trial_of(design, y, weight)
    assert exclude(alone, refit, units, Rules(receivers=0)) is Refusal.INCONSISTENT
