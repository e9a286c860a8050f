"""Whether measurements agree: two tests of residuals, and what they are worth by draws of noise."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
import pytest

from gnss_hil.flightsw.integrity.consistency import Trial, agree, chi_square_test, outlier_limit, outlier_test
from gnss_hil.flightsw.integrity.exclusion import isolate
from tests.support.fits import drawn_design, trial_of

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/consistency.py",
    what="Measurements that agree, by chi-square and by the largest normalised residual",
    by="rates of false alarms of noise drawn 20,000 times; least squares of all at once by NumPy lstsq",
    status="validated",
)


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


def test_a_single_fault_that_drowns_in_the_sum_of_squares_stands_out():
    """Twenty residuals of a fit of five unknowns: a fault of 6.5 sigma is below the limit of the sum."""
    rng = np.random.default_rng(2)
    design = np.column_stack((rng.normal(size=(20, 4)), np.ones(20)))
    covariance = np.linalg.inv(design.T @ design)
    project = np.eye(20) - design @ covariance @ design.T
    residual = project @ (6.5 / np.sqrt(project[7, 7]) * (np.arange(20) == 7))
    trial = Trial(None, design, residual, np.ones(20), covariance)
    assert chi_square_test(trial) and not outlier_test(trial)
    assert isolate(np.arange(20), trial) == {7}


def test_false_alarms_are_as_rare_as_claimed():
    """Of noise alone, both tests: their limits at 1e-2 instead of 1e-5, which draws can show."""
    rng = np.random.default_rng(3)
    design = np.column_stack((rng.normal(size=(18, 4)), np.ones(18)))
    weight = np.linalg.inv(np.diag(rng.uniform(0.5, 2, 18)) + 0.4 * np.ones((18, 18)))
    covariance = np.linalg.inv(design.T @ weight @ design)
    root = np.linalg.cholesky(np.linalg.inv(weight))
    noise = root @ rng.normal(size=(18, 20_000))
    residual = noise - design @ (covariance @ (design.T @ (weight @ noise)))
    left = weight - weight @ design @ covariance @ design.T @ weight
    worst = ((weight @ residual) ** 2 / np.diag(left)[:, None]).max(axis=0)
    for limit_rate in (1e-2, 1e-3):
        # Sidak's and Bonferroni's limits differ by half of the rate's square.
        limit = NormalDist().inv_cdf(1 - limit_rate / 2 / 18) ** 2
        assert (worst > limit).mean() == pytest.approx(limit_rate, rel=0.35)
    assert outlier_limit(18) == pytest.approx(NormalDist().inv_cdf(1 - 0.5e-5 / 36) ** 2)
    found = [outlier_test(Trial(None, design, r, weight, covariance)) for r in residual.T[:2000]]
    assert all(found) == bool((worst[:2000] <= outlier_limit(18)).all())


def test_without_redundancy_nothing_is_tested():
    """Four ranges for four unknowns: what rounding leaves of a covariance and of residuals is not judged."""
    rounded = (1 - 1e-5) * np.eye(4)
    found = Trial(None, np.eye(4), np.array([0.1, 0, 0, 0]), np.ones(4), rounded)
    assert found.freedom == 0 and not outlier_test(found)
    assert agree(found)


def test_a_measurement_that_nothing_checks_raises_no_alarm():
    """The only one of its clock: its residual is rounding, and so is what noise would leave of it."""
    rng = np.random.default_rng(4)
    design = np.column_stack((rng.normal(size=(12, 3)), np.ones(12), np.zeros(12)))
    design[11, 3:] = 0.0, 1.0
    covariance = np.linalg.inv(design.T @ design)
    residual = np.where(np.arange(12) == 11, 1e-6, 0.0)
    assert outlier_test(Trial(None, design, residual, np.ones(12), covariance))
