"""What is excluded together, what is judged beside the measurements, and how well a fix is tested."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.integrity import exclusion
from gnss_hil.flightsw.integrity.exclusion import (
    BEFORE,
    MOST_SETS,
    OF_SATELLITES,
    TOLERATED,
    Kept,
    Refusal,
    Rules,
    Trial,
    Units,
    agree,
    exclude,
    isolate,
)
from gnss_hil.flightsw.records.solution import NoFix
from gnss_hil.flightsw.records.solution import Tested as Word
from tests.flightsw.estimation.test_position import SKY, craft, errors, fix_of, in_view, measurements
from tests.flightsw.integrity.test_exclusion import offered
from tests.support import synthetic_epochs as s

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/exclusion.py",
    what="Satellites and receivers excluded, and how well a fix is tested",
    by="least squares of measurements and of what was known before by NumPy lstsq; faults drawn 20,000 times",
    status="validated",
)


def trial_of(design, y, weight, known=None, offset=None):
    """A fit of y, and beside it what was known before of its first unknowns."""
    full = np.diag(weight) if weight.ndim == 1 else weight
    covariance = np.linalg.inv(design.T @ full @ design)
    x = covariance @ design.T @ full @ y
    trial = Trial(x, design, y - design @ x, weight, covariance)
    return trial if known is None else trial.beside(offset - x[: len(offset)], known)


def drawn_design(rng, n):
    """Of n ranges: lines of sight and a clock."""
    los = rng.normal(size=(n, 3))
    return np.column_stack((los / np.linalg.norm(los, axis=1)[:, None], np.ones(n)))


@pytest.mark.parametrize("correlated", [False, True])
def test_beside_what_was_known_before_is_a_fit_of_both(correlated):
    rng = np.random.default_rng(1)
    design, y, before = drawn_design(rng, 9), 5 * rng.normal(size=9), 5 * rng.normal(size=3)
    root = np.diag(rng.uniform(0.5, 2, 9)) + 0.3 * correlated
    known_root = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    weight = np.linalg.inv(root @ root.T)
    known = known_root @ known_root.T
    trial = trial_of(design, y, weight if correlated else weight.diagonal(), known, before)

    both = np.vstack((design, np.eye(3, 4)))
    whiten = np.linalg.inv(np.block([[root, np.zeros((9, 3))], [np.zeros((3, 9)), known_root]]))
    values = np.concatenate((y, before))
    x, chi2, *_ = np.linalg.lstsq(whiten @ both, whiten @ values, rcond=None)
    assert trial.residual == pytest.approx(values - both @ x, abs=1e-9)
    assert trial.chi_square == pytest.approx(chi2[0])
    assert trial.covariance == pytest.approx(np.linalg.inv(both.T @ whiten.T @ whiten @ both))
    assert (trial.freedom, trial.before) == (8, 3) and np.array_equal(trial.design, both)
    own = trial_of(design, y, weight)
    assert trial.found == pytest.approx(own.found) and trial.found != pytest.approx(x), "what was found stays"


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


class Case:
    """A drawn geometry of satellites (n,), whose own errors are in all their ranges; what was known before to
    so many metres, if it was."""

    def __init__(self, seed, sat, known_m=None):
        self.sat, self.known_m = sat, known_m
        self.design = drawn_design(np.random.default_rng(seed), len(np.unique(sat)))[sat]
        self.errors = np.eye(len(sat)) + 0.5 * (sat[:, None] == sat)
        self.weight = np.linalg.inv(self.errors)
        covariance = np.linalg.inv(self.design.T @ self.weight @ self.design)
        self.gain = (covariance @ self.design.T @ self.weight)[:3]
        self.information = np.linalg.inv(covariance[:3, :3])

    def trial(self, y, before=(0.0, 0.0, 0.0)):
        known = None if self.known_m is None else self.known_m**2 * np.eye(3)
        return trial_of(self.design, y, self.weight, known, np.asarray(before))

    @property
    def said(self):
        covariance = np.linalg.inv(self.information)
        return exclusion.tested(self.trial(np.zeros(len(self.sat))), self.gain, covariance, self.sat)

    def shown(self, fault):
        """By how many sigmas a fault (n,) moves the fix, for each that it stands out by."""
        moved = self.gain @ fault
        return np.sqrt(moved @ self.information @ moved / self.trial(fault).chi_square)

    def missed(self, fault, draws, rng):
        """Share of drawn errors with a fault (n,) that moved the fix too far and agree all the same."""
        y = np.linalg.cholesky(self.errors) @ rng.normal(size=(len(fault), draws)) + fault[:, None]
        before = (self.known_m or 0.0) * rng.normal(size=(3, draws))
        moved = self.gain @ fault
        along = self.information @ moved / np.sqrt(moved @ self.information @ moved)
        far = np.flatnonzero(along @ self.gain @ y > TOLERATED)
        return sum(agree(self.trial(y[:, k], before[:, k])) for k in far) / draws


ALONE, SOME, TWICE = np.arange(14), np.array([*range(20), 0, 1, 2]), np.repeat(np.arange(22), 2)


@pytest.mark.slow(seconds=8)
@pytest.mark.parametrize("known_m", [None, 1.0], ids=["by itself", "with an orbit"])
@pytest.mark.parametrize("sat", [ALONE, SOME, TWICE], ids=["on one antenna", "some on two", "on two"])
def test_of_a_fix_that_is_tested_no_fault_goes_unseen_more_than_once_in_twenty(sat, known_m):
    """The least well tested of many geometries, its worst satellite, the worst size of its fault."""
    chosen = [case for seed in range(200) if (case := Case(seed, sat, known_m)).said is Word.TESTED]
    assert 4 < len(chosen) < 200
    case, fault = max(
        ((case, 1.0 * (sat == k)) for case in chosen for k in np.unique(sat)),
        key=lambda one: one[0].shown(one[1]),
    )
    rng, fault = np.random.default_rng(8), fault / np.sqrt(case.trial(fault).chi_square)
    sizes = np.arange(4.0, 9.0, 0.25)
    worst = max(sizes, key=lambda size: case.missed(size * fault, 1_000, rng))
    missed = case.missed(worst * fault, 20_000, rng)
    print(f"{len(chosen)} tested; at {worst} sigma missed {missed:.4f}")
    assert missed < 0.05 + 3 * np.sqrt(0.05 / 20_000)


@pytest.mark.parametrize(
    ("count", "known_m", "said"),
    [
        (4, None, "UNTESTED"),
        (5, None, "CHECKED"),
        (4, 1.0, "CHECKED"),
        (40, None, "TESTED"),
        (40, 1.0, "TESTED"),
    ],
)
def test_how_well_a_fix_is_tested(count, known_m, said):
    assert Case(3, np.arange(count), known_m).said.name == said


def test_a_satellite_that_nothing_checks_is_not_by_its_own_ranges():
    """Four satellites on four antennas each: all ranges of one may be off, and agree."""
    case = Case(3, np.repeat(np.arange(4), 4))
    y = 500.0 * (case.sat == 2)
    assert agree(case.trial(y)) and np.linalg.norm(case.gain @ y) > 100
    assert case.said is Word.UNTESTED


def test_what_no_fix_is_moved_by_need_not_be_checked():
    """The only range of its clock."""
    case = Case(3, np.arange(40))
    case.design = np.column_stack((case.design, np.zeros(40)))
    case.design[39] = 0.0, 0.0, 1.0, 0.0, 1.0
    case.gain[:, 39] = 0.0
    assert case.said is Word.TESTED
