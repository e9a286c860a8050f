"""How well a fix is tested: faults of satellites, drawn, and how many of them go unseen."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.flightsw.integrity import reliability
from gnss_hil.flightsw.integrity.consistency import agree
from gnss_hil.flightsw.integrity.reliability import TOLERATED
from gnss_hil.flightsw.records.solution import Tested as Word
from tests.support.fits import drawn_design, trial_of

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/reliability.py",
    what="How well a fix is tested",
    by="faults of satellites drawn 20,000 times: one in twenty goes unseen at most",
    status="validated",
)


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
        return reliability.tested(self.trial(np.zeros(len(self.sat))), self.gain, covariance, self.sat)

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
