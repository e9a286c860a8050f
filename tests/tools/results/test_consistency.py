"""Normalised squared errors: of draws from a covariance they are 3 on the mean, of others not."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.results.consistency import clock_nees, clock_of_fix, nees, position_nees, velocity_nees

pytestmark = pytest.mark.verifies(
    "tools/results/consistency.py",
    what="Errors by the covariance that was published",
    by="draws of NumPy's multivariate normal; by hand",
    status="validated",
)

COVARIANCE = np.array([[4.0, 1.2, -0.5], [1.2, 1.0, 0.3], [-0.5, 0.3, 2.25]])
SIGMA = np.sqrt(np.diag(COVARIANCE))
RHO = np.array([COVARIANCE[0, 1] / 2.0, COVARIANCE[0, 2] / 3.0, COVARIANCE[1, 2] / 1.5])


def test_draws_are_as_large_as_their_covariance_says():
    n = 4000
    draws = np.random.default_rng(1).multivariate_normal(np.zeros(3), COVARIANCE, n)
    found = nees(draws, np.tile(SIGMA, (n, 1)), np.tile(RHO, (n, 1)))
    # Chi-square of three: deviation sqrt(6 / n).
    assert found.mean() == pytest.approx(3.0, abs=4 * np.sqrt(6 / n))
    twice = nees(2 * draws, np.tile(SIGMA, (n, 1)), np.tile(RHO, (n, 1)))
    assert twice.mean() == pytest.approx(4 * found.mean())


def test_by_hand():
    assert nees(np.array([[3.0, 0, 4.0]]), np.array([[3.0, 1, 2]]), np.zeros((1, 3))) == pytest.approx([5.0])


def test_what_is_missing_or_no_covariance_is_none():
    error, sigma, rho = np.ones((4, 3)), np.ones((4, 3)), np.zeros((4, 3))
    error[0, 0] = sigma[1, 2] = np.nan
    rho[2] = 1.0
    assert np.isnan(nees(error, sigma, rho)).tolist() == [True, True, True, False]


def test_of_the_columns_of_fixes():
    names = {f"sigma_{a}_m": 2.0 for a in "xyz"} | {f"sigma_v{a}_mps": 0.5 for a in "xyz"}
    names |= {f"rho_{v}{pair}": 0.0 for v in ("", "v") for pair in ("xy", "xz", "yz")}
    names |= {"clock_bias_m": 7.0, "sigma_clock_bias_m": 2.0}
    fixes = {name: np.array([value]) for name, value in names.items()}
    assert position_nees(fixes, np.array([[2.0, 4.0, 0.0]])) == pytest.approx([5.0])
    assert velocity_nees(fixes, np.array([[0.5, 0.0, 0.0]])) == pytest.approx([1.0])
    assert clock_nees(fixes, np.array([3.0])) == pytest.approx([4.0])


def test_a_clock_is_compared_with_itself_whichever_it_is():
    """Of receivers with clocks of their own a fix of one has the clock of that one."""
    truth_s = np.array([[1.0, 2.0, 3.0]] * 4)
    found = clock_of_fix({"clock_domain": np.array([0, 2, np.nan, 5])}, truth_s)
    assert found[:2].tolist() == [1.0, 3.0] and np.isnan(found[2:]).all()


def test_what_steps_leave_open_is_not_judged():
    """Correlations as frames carry them, in steps of 1e-4: of a poor geometry they may be anything."""
    rho = np.array(
        [[0.9999, 0.9999, 1.0], [0.9999, -0.9999, -0.9999], [0.9999, 0.9998, 0.9995], [0.99, 0, 0]]
    )
    found = nees(np.ones((4, 3)), np.ones((4, 3)), rho)
    assert np.isnan(found).tolist() == [True, True, True, False]
    assert found[3] == pytest.approx(2 / 1.99 + 1)


@pytest.mark.parametrize(
    ("unit", "v", "of", "most"), [("m", "", position_nees, 655.35), ("mps", "v", velocity_nees, 65.535)]
)
def test_a_saturated_deviation_is_none(unit, v, of, most):
    fixes = {f"sigma_{v}{a}_{unit}": np.array([most - 0.1, most]) for a in "xyz"}
    fixes |= {f"rho_{v}{pair}": np.zeros(2) for pair in ("xy", "xz", "yz")}
    assert np.isnan(of(fixes, np.ones((2, 3)))).tolist() == [False, True]


def test_a_saturated_deviation_of_a_clock_is_none():
    fixes = {"clock_bias_m": np.zeros(2), "sigma_clock_bias_m": np.array([16_777.214, 16_777.215])}
    assert np.isnan(clock_nees(fixes, np.ones(2))).tolist() == [False, True]


def test_a_deviation_of_zero_is_as_wrong_as_its_error():
    """What a step leaves open is uniform, of variance step^2 / 12: an error of a step counts 12 times. Left
    out, who publishes zeros would have no squared error at all."""
    axes = {f"sigma_{a}_m": np.zeros(1) for a in "xyz"} | {f"sigma_v{a}_mps": np.zeros(1) for a in "xyz"}
    axes |= {f"rho_{v}{pair}": np.zeros(1) for v in ("", "v") for pair in ("xy", "xz", "yz")}
    assert position_nees(axes, np.array([[0.01, 0.0, 0.0]])) == pytest.approx([12.0])
    assert velocity_nees(axes, np.array([[0.0, 0.001, 0.0]])) == pytest.approx([12.0])
    clock = {"clock_bias_m": np.array([0.001]), "sigma_clock_bias_m": np.zeros(1)}
    assert clock_nees(clock, np.zeros(1)) == pytest.approx([12.0])
