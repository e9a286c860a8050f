"""Weights are the inverse of the covariance, by NumPy's inverse of it written out."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.flightsw.measurement.weights import times, weight

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/weights.py",
    what="Weights of measurements with errors in common",
    by="NumPy's inverse of the covariance",
    status="validated",
)

RNG = np.random.default_rng(4)
OWN, COMMON = RNG.uniform(0.1, 4, 9), RNG.normal(size=(9, 3))


def test_it_is_the_inverse():
    covariance = np.diag(OWN) + COMMON @ COMMON.T
    assert weight(OWN, COMMON) == pytest.approx(np.linalg.inv(covariance))


def test_without_errors_in_common_it_is_a_diagonal():
    assert weight(OWN, np.zeros((9, 0))) == pytest.approx(1 / OWN)


def test_both_forms_multiply_alike():
    y, columns = RNG.normal(size=9), RNG.normal(size=(9, 4))
    for z in (y, columns):
        assert times(1 / OWN, z) == pytest.approx(times(np.diag(1 / OWN), z))
