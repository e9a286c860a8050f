"""Fixes of antennas whose covariance is that of the centre of mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.attitude.attitude import Attitude, Followed
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.best_antenna import best_antenna
from gnss_hil.flightsw.estimation.receiver_mean import receiver_mean
from gnss_hil.flightsw.estimation.snapshot import Snapshot
from gnss_hil.flightsw.records.solution import OrbitState
from tests.support import synthetic_epochs as s
from tests.support.budgets import budget
from tests.support.fixes import craft, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/unreduced.py",
    what="The lever arm in the covariance of fixes of antennas",
    by="errors of noise-free fixes against the centre of mass of another model, for every attitude",
    status="validated",
)

SKY = s.constellation()
NAVIGATORS = pytest.mark.parametrize("solve", [receiver_mean, best_antenna])


def epoch(c, count=8):
    """The same satellites on every antenna, without noise."""
    sats = [sat for _, sat in in_view(c, count)]
    return measurements(s.observe(c, [(a, sat) for a in range(4) for sat in sats], SKY))


def attitude_of(c):
    dcm = c.dcm_body_from_eci @ s.ecef_from_eci(0.0).T
    return Attitude(dcm, np.asarray(c.rate_body), s.T0_NS, 0, Followed(dcm, s.T0_NS))


def fixed(solve, c, m, attitude, levers):
    """From where it is: the antenna that leads is 2."""
    start = OrbitState(s.T0_NS, s.truth_ecef(c)[0], None, s.T0_NS)
    inputs = FixInputs(attitude, levers, c.domain, budget())
    return solve(m, inputs, Snapshot(start, 2))[0]


def added(solve, c, m, attitude):
    """What the lever arms add to the covariances of position and velocity."""
    whole, without = (
        fixed(solve, c, m, attitude, levers) for levers in (c.lever_body, np.zeros_like(c.lever_body))
    )
    assert np.array_equal(whole.position_m, without.position_m), "nothing is reduced"
    assert np.array_equal(whole.velocity_mps, without.velocity_mps)
    assert np.array_equal(whole.clock_variance_m2, without.clock_variance_m2)
    return (
        whole.covariance_m2 - without.covariance_m2,
        whole.velocity_covariance_m2ps2 - without.velocity_covariance_m2ps2,
        whole,
    )


@NAVIGATORS
def test_with_an_attitude_it_is_the_square_of_what_the_fix_is_off(solve):
    c = craft()
    place, motion, fix = added(solve, c, epoch(c), attitude_of(c))
    truth_m, truth_mps = s.truth_ecef(c)
    off, off_mps = fix.position_m - truth_m, fix.velocity_mps - truth_mps
    assert np.linalg.norm(off) > 1 and np.linalg.norm(off_mps) > 0.01
    assert place == pytest.approx(np.outer(off, off), abs=1e-3)
    assert motion == pytest.approx(np.outer(off_mps, off_mps), abs=1e-5)


@NAVIGATORS
def test_without_one_it_is_the_mean_over_all_attitudes(solve):
    """And the rate that of a craft that points at the Earth, by its own velocity."""
    c = craft()
    place, motion, fix = added(solve, c, epoch(c), None)
    off = fix.position_m - s.truth_ecef(c)[0]
    assert place == pytest.approx(np.eye(3) * (off @ off) / 3, abs=1e-3)
    place_m, turning = fix.position_m, np.cross(fix.position_m, fix.velocity_mps)
    square = (np.linalg.norm(turning) / (place_m @ place_m)) ** 2
    assert 0.0009 < np.sqrt(square) < 0.0012, "once in one and a half hours, less the Earth's turn"
    assert motion == pytest.approx(place * square)


def test_of_receivers_without_a_solution_there_is_no_lever_arm():
    c = craft()
    m = epoch(c)
    m = m[(m.receiver != 2) | (np.arange(len(m)) % 8 < 3)]
    place, _, fix = added(receiver_mean, c, m, attitude_of(c))
    assert set(m.receiver[fix.used]) == {0, 1, 3}
    off = fix.position_m - s.truth_ecef(c)[0]
    assert place == pytest.approx(np.outer(off, off), abs=1e-3)


@NAVIGATORS
def test_without_a_velocity_there_is_no_covariance_of_one(solve):
    c = craft()
    m = epoch(c)
    m = replace(m, range_rate_mps=m.range_rate_mps + 300.0 * np.arange(len(m)) ** 2)
    for attitude in (None, attitude_of(c)):
        fix = fixed(solve, c, m, attitude, c.lever_body)
        assert fix.velocity_mps is None and fix.velocity_covariance_m2ps2 is None
        assert np.trace(fix.covariance_m2) > 2
