"""Rotations of many bodies at once, against SciPy's (active: its matrix is the transpose of ours)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.emulator.numerics.rotations import dcm_of_quaternion, dcm_of_quaternions, product

TURNS, OTHERS = (Rotation.from_quat(q) for q in np.random.default_rng(2).normal(size=(2, 20, 4)))


def scalar_first(turns: Rotation) -> np.ndarray:
    return np.roll(turns.as_quat(), 1, axis=1)


def test_matrices_of_many_quaternions():
    found = dcm_of_quaternions(scalar_first(TURNS))
    assert found == pytest.approx(TURNS.as_matrix().transpose(0, 2, 1), abs=1e-15)
    assert found == pytest.approx(np.array([dcm_of_quaternion(q) for q in scalar_first(TURNS)]), abs=0)


def test_a_product_is_the_one_turn_and_then_the_other():
    a, b = scalar_first(TURNS), scalar_first(OTHERS)
    both = dcm_of_quaternions(b) @ dcm_of_quaternions(a)
    assert dcm_of_quaternions(product(a, b)) == pytest.approx(both, abs=1e-14)
    assert product(a[0], b[0]) == pytest.approx(product(a, b)[0], abs=0)
    assert product(a, b) == pytest.approx(scalar_first(TURNS * OTHERS), abs=1e-14)
