"""Covariance of ranges: what each errs by for itself and what some have in common."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common.vehicle import ReceiverFigures
from gnss_hil.flightsw.measurement.budget import budget_of, range_errors
from gnss_hil.flightsw.measurement.code_range import code_ranges
from gnss_hil.flightsw.measurement.ionosphere import USUAL, Ionosphere
from gnss_hil.flightsw.measurement.options import MeasurementOptions
from gnss_hil.flightsw.records.solution import ReceiverDelays
from gnss_hil.tools.command_line.main import main
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET, SPACE_M, budget
from tests.support.fixes import SKY, craft, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/budget.py",
    what="The error budget of ranges",
    by="covariances written out by hand; fixes of emulated and real receivers against their truth",
    status="validated",
)


def covariance(m, with_budget=BUDGET, delays=None):
    """(n, n) of ranges, from the weight along their rays."""
    errors = range_errors(m, with_budget, None, delays)
    code = code_ranges(m, np.zeros((3, len(m))), np.ones((len(m), 1)), errors)
    _, weight = errors.at(code.rays(s.truth_ecef(craft())[0]))
    return np.diag(1 / weight) if weight.ndim == 1 else np.linalg.inv(weight)


def twice(antennas=2, count=4):
    """The same satellites on several antennas."""
    c = craft()
    sats = [sat for _, sat in in_view(c, count)]
    return measurements(s.observe(c, [(a, sat) for a in range(antennas) for sat in sats], SKY))


def test_ranges_of_satellites_of_their_own_are_independent():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 12), SKY))
    assert covariance(m) == pytest.approx(np.diag(m.code_variance_m2 + SPACE_M**2))


def test_a_satellites_own_error_is_in_all_its_ranges():
    m = twice()
    same = m.sat[:, None] == m.sat
    assert covariance(m) == pytest.approx(np.diag(m.code_variance_m2) + SPACE_M**2 * same)


def test_it_does_not_average_out():
    """The mean of four ranges of one satellite: a quarter of the noise, all of the satellite's error."""
    m = twice(antennas=4, count=1)
    mean = np.full(4, 0.25)
    assert mean @ covariance(m) @ mean == pytest.approx(m.code_variance_m2[0] / 4 + SPACE_M**2)


def test_a_receivers_delay_is_in_all_that_it_measures():
    m = twice()
    same = m.receiver[:, None] == m.receiver
    without = covariance(m)
    assert covariance(m, budget(delay_m=3.0)) == pytest.approx(without + 9.0 * same)


def test_delays_that_are_known_better_count_as_they_are_known():
    m = twice()
    root = np.array([[0.2, 0.0, 0, 0], [0.1, 0.3, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    known = (root @ root.T)[m.receiver[:, None], m.receiver]
    assert covariance(m, budget(delay_m=3.0), ReceiverDelays(np.zeros(4), root)) == pytest.approx(
        covariance(m) + known
    )


def test_ura_scale_is_of_the_satellites_error_and_a_stated_sigma_of_everything():
    m = twice()
    noise = np.diag(m.code_variance_m2)
    assert covariance(m, budget(ura_scale=0.0)) == pytest.approx(noise)
    same = m.sat[:, None] == m.sat
    assert covariance(m, budget(ura_scale=2.0)) == pytest.approx(noise + (2 * SPACE_M) ** 2 * same)
    assert covariance(m, replace(BUDGET, range_sigma_m=5.0)) == pytest.approx(25.0 * np.eye(len(m)))


def test_by_a_stated_sigma_no_receiver_has_a_delay():
    figures = ReceiverFigures(delay_m=3.0)
    assert budget_of(figures, MeasurementOptions()).delay_m == 3.0
    assert budget_of(figures, MeasurementOptions(range_sigma_m=5.0)).delay_m == 0.0


@pytest.mark.parametrize("sigma_m", [1.0, 5.0])
def test_a_stated_sigma_flies(tmp_path, sigma_m):
    words = ["run", "soyuz", "--duration", "60", "--interval", "10", "--bus", "inline", "--quiet"]
    words += [
        "--no-log",
        "--no-report",
        "--option",
        f"range_sigma_m={sigma_m}",
        "--out",
        str(tmp_path / "run"),
    ]
    assert main(words) == 0


def test_ranges_without_ionosphere_are_weighed_without_one():
    """Of pairs the carriers have cancelled it: no error of it is in common, and weights stay a diagonal."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, 12), SKY))
    sky = Ionosphere(USUAL, 50_400.0)
    assert range_errors(m, BUDGET, sky).ionosphere is sky
    assert range_errors(replace(m, electrons=0 * m.electrons), BUDGET, sky).ionosphere is None
