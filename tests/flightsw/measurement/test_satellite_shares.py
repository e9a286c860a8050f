"""What measurements of one satellite have in common, by covariances written out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.flightsw.measurement.budget import range_errors
from gnss_hil.flightsw.measurement.ionosphere import USUAL, Ionosphere, delay, delay_rate
from gnss_hil.flightsw.measurement.range_model import rays
from gnss_hil.flightsw.measurement.range_rate import range_rates
from gnss_hil.flightsw.measurement.satellite_shares import none_shared, satellite_shares
from tests.flightsw.measurement.test_budget import twice
from tests.support import synthetic_epochs as s
from tests.support.budgets import SPACE_M, budget
from tests.support.fixes import craft

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/satellite_shares.py",
    what="Errors that all measurements of a satellite have alike",
    by="covariances written out by hand",
    status="validated",
)

SKY = Ionosphere(USUAL, 50_400.0)


@given(st.lists(st.integers(0, 5), max_size=12))
def test_a_satellite_of_several_is_a_column_and_of_one_alone_a_variance(sats):
    sat = np.array(sats, np.int64)
    own, sigma = 1.0 + np.arange(len(sat)), 0.5 + 0.1 * np.arange(len(sat))
    variance, columns = satellite_shares(sat).split(own, sigma)
    expected = np.diag(own) + np.outer(sigma, sigma) * (sat[:, None] == sat)
    assert np.diag(variance) + columns @ columns.T == pytest.approx(expected)
    assert columns.shape[1] == sum(sats.count(one) > 1 for one in set(sats))


def test_without_any_shared_it_is_the_diagonal():
    variance, columns = none_shared(3).split(np.ones(3), np.array([0.0, 1.0, 2.0]))
    assert variance.tolist() == [1, 2, 5] and columns.shape == (3, 0)


def seen():
    m = twice()
    place = np.repeat(s.truth_ecef(craft())[0][:, None], len(m), 1)
    return m, rays(m.pos_sv_m, place), m.sat[:, None] == m.sat


def test_rays_of_a_satellite_to_several_antennas_go_through_the_same_electrons():
    m, along, same = seen()
    own_m2, common_m = range_errors(m, budget(), SKY).along(along)
    found = delay(SKY, along.antenna_m, along.los, along.distance_m)
    expected = np.diag(m.code_variance_m2) + np.outer(found.common_m, found.common_m)
    expected = expected + same * (SPACE_M**2 + np.sqrt(np.outer(found.own_m2, found.own_m2)))
    assert np.sqrt(found.own_m2).max() > 0.1
    assert np.diag(own_m2) + common_m @ common_m.T == pytest.approx(expected)


def test_so_do_their_rates():
    m, along, same = seen()
    velocity = np.repeat(s.truth_ecef(craft())[1][:, None], len(m), 1)
    rate = delay_rate(SKY, along, velocity, m.vel_sv_mps)
    rates = range_rates(m, np.zeros((len(m), 4)), along, 0 * velocity).without(rate, m.electrons)
    own, common = rates.errors()
    expected = np.diag(m.rate_variance_m2ps2) + np.outer(rate.common_m, rate.common_m)
    expected = expected + same * (m.sat_rate_sigma_mps**2 + np.sqrt(np.outer(rate.own_m2, rate.own_m2)))
    assert np.diag(own) + common @ common.T == pytest.approx(expected)
    assert rates.variance == pytest.approx(expected.diagonal())
