"""Errors of fixes along the orbit's axes, with deviations and squared errors known without a computer."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.report.errors import clock_errors, position_errors, velocity_errors
from gnss_hil.tools.results.summary import LIGHT_MPS

pytestmark = pytest.mark.verifies(
    "tools/report/errors.py",
    what="Report: errors of fixes",
    by="errors and deviations known without a computer",
    status="validated",
)

TURNED = np.array([[[0, 1.0, 0], [0, 0, 1.0], [1.0, 0, 0]]] * 2)
"""Radial is y, along z, cross x."""


def fixes():
    one = np.ones(2)
    columns = {f"{v}{a}_{u}": 10 * one for v, u in (("", "m"), ("v", "mps")) for a in "xyz"}
    columns |= {f"sigma_{v}{a}_{u}": s * one for v, u in (("", "m"), ("v", "mps"))
                for a, s in zip("xyz", (1, 2, 4), strict=True)}  # fmt: skip
    columns |= {f"rho_{v}{pair}": 0 * one for v in ("", "v") for pair in ("xy", "xz", "yz")}
    columns["x_m"] = np.array([10, np.nan])
    return columns | {"clock_bias_m": np.array([31.0, np.nan]), "sigma_clock_bias_m": 2 * one}


@pytest.mark.parametrize("of", [position_errors, velocity_errors])
def test_errors_and_deviations_turn_with_the_axes(of):
    found = of(TURNED, fixes(), np.array([[7.0, 8, 6]] * 2))
    assert found.value[0].tolist() == [2, 4, 3]
    assert found.sigma[0].tolist() == pytest.approx([2, 4, 1])
    assert found.nees[0] == pytest.approx(3**2 + 1 + 1)


def test_where_there_is_no_fix_there_is_nothing():
    found = position_errors(TURNED, fixes(), np.array([[7.0, 8, 6]] * 2))
    assert np.isnan(found.value[1]).all() and np.isnan(found.sigma[1]).all() and np.isnan(found.nees[1])


def test_the_clock_is_compared_in_metres():
    found = clock_errors(fixes(), np.array([27 / LIGHT_MPS, 0]))
    assert found.value_m[0] == pytest.approx(4) and found.nees[0] == pytest.approx(4)
    assert np.isnan(found.value_m[1]) and np.isnan(found.nees[1])
