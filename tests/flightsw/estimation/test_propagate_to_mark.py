"""Marks that a receiver's clock showed: the latch is elsewhere, the fix is at the mark all the same.

Measurements are made in the inertial frame at the instant of the latch; what the fix is judged by is the
circular orbit at the mark.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.attitude.attitude import attitude_now, levers_ecef
from gnss_hil.flightsw.estimation.position import solve
from gnss_hil.flightsw.estimation.propagate_to_mark import in_doubt, orbit_in_doubt, propagated_to_mark
from gnss_hil.flightsw.integrity.publishable import publishable
from gnss_hil.flightsw.records.epoch import AttitudeReport
from gnss_hil.flightsw.records.solution import FASTEST_MPS, Fix, NoFix, OrbitState, Solution, without_motion
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET
from tests.support.fixes import craft, in_view, measurements
from tests.support.flights import fly, soyuz, status
from tests.support.flown import FakeBus, decoded, position_of

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
SKY = s.constellation()
OFFSETS_S = [1e-3, -1e-3, 1e-2, -1e-2]


def latched(c, domain=0):
    """Fix of the instant at which the domain's clock shows T0."""
    t = s.shown(c, domain, 0.0)
    dcm = c.dcm_eci(t) @ s.ecef_from_eci(t).T
    lever, rate = levers_ecef(
        attitude_now(AttitudeReport(s.quaternion(dcm), c.rate_body), None, s.T0_NS, 0), c.lever_body
    )
    m = measurements(s.observe(c, in_view(c, 16), SKY, t))
    return solve(m, lever.T[:, m.receiver], rate.T[:, m.receiver], c.domain[m.receiver], None, BUDGET)


@pytest.mark.verifies(
    "flightsw/estimation/propagate_to_mark.py",
    what="Fixes brought from the latch to the mark",
    by=(
        "inertial-frame measurements at the latch, the orbit at the mark: 0.1 mm for +-1 and +-10 ms; the C "
        "flight software on the same frames"
    ),
    status="validated",
)
@pytest.mark.parametrize("offset_s", OFFSETS_S)
def test_fix_of_the_latch_is_brought_to_the_mark(offset_s):
    c = craft(clock_s=(offset_s,))
    position, velocity = s.truth_ecef(c)
    of_latch = latched(c)
    # 7.66 km/s of a circular orbit, less 0.3 km/s that the Earth turns along.
    away_m = np.linalg.norm(of_latch.position_m - position)
    assert away_m == pytest.approx(np.linalg.norm(velocity) * abs(offset_s), rel=1e-3)
    fix = propagated_to_mark(of_latch, 1, None)
    # The Earth's flattening, which the circle lacks, makes 1 um of 10 ms.
    assert np.linalg.norm(fix.position_m - position) < 1e-4
    assert np.linalg.norm(fix.velocity_mps - velocity) < 5e-4
    assert fix.clock_m[0] == pytest.approx(s.C * (offset_s + 2e-8 * s.shown(c, 0, 0.0)), abs=1e-4)
    assert propagated_to_mark(of_latch, 0, None) is of_latch


@pytest.mark.parametrize("misfit", [1.0, 4.0])
def test_at_a_mark_in_doubt_it_is_as_uncertain_as_the_way_that_it_may_be_off(misfit):
    c, doubt_s = craft(), 5e-4
    (here, slow), (there, fast) = s.truth_ecef(c), s.truth_ecef(c, doubt_s)
    fix = replace(latched(c), misfit=misfit)
    found = in_doubt(fix, doubt_s, None)
    of_position = misfit * (found.covariance_m2 - fix.covariance_m2)
    of_velocity = found.velocity_covariance_m2ps2 - fix.velocity_covariance_m2ps2
    assert of_position == pytest.approx(np.outer(there - here, there - here), rel=1e-3, abs=1e-2)
    assert of_velocity == pytest.approx(np.outer(fast - slow, fast - slow), rel=1e-2, abs=1e-7)
    assert in_doubt(without_motion(fix), doubt_s, None) is NoFix.NO_VELOCITY
    assert in_doubt(without_motion(fix), doubt_s, slow).covariance_m2 == pytest.approx(
        found.covariance_m2, rel=1e-4
    )
    orbit = OrbitState(0, here, slow, 0, fix.covariance_m2, fix.velocity_covariance_m2ps2)
    moved = orbit_in_doubt(orbit, doubt_s)
    assert moved.covariance_m2 - orbit.covariance_m2 == pytest.approx(of_position, rel=1e-3, abs=1e-2)
    assert orbit_in_doubt(replace(orbit, velocity_mps=None), doubt_s).covariance_m2 is orbit.covariance_m2


@pytest.mark.parametrize("domain", [0, 2])
def test_it_is_the_clock_that_the_mark_names(domain):
    c = craft(domain=(0, 0, 2, 2), clock_s=(3e-3, 0.0, -4e-3), rate=(1e-8, 0.0, -3e-8))
    fix = propagated_to_mark(latched(c, domain), domain + 1, None)
    assert np.linalg.norm(fix.position_m - s.truth_ecef(c)[0]) < 1e-4


def test_without_a_velocity_the_known_one_leads_or_there_is_no_fix():
    c = craft(clock_s=(1e-3,))
    position, velocity = s.truth_ecef(c)
    still = replace(latched(c), velocity_mps=None, drift_mps=None)
    assert propagated_to_mark(still, 1, None) is NoFix.NO_VELOCITY
    fix = propagated_to_mark(still, 1, velocity + 0.5)
    assert fix.velocity_mps is None and fix.drift_mps is None
    assert np.linalg.norm(fix.position_m - position) == pytest.approx(0.5e-3 * 3**0.5, rel=0.02)


def test_a_velocity_beyond_the_bus_goes_with_all_that_is_said_of_it():
    fix = replace(latched(craft(clock_s=(1e-3,))), velocity_mps=np.array([2 * FASTEST_MPS, 0.0, 0.0]))
    assert fix.velocity_covariance_m2ps2 is not None
    found = propagated_to_mark(fix, 1, None)
    assert found.velocity_mps is found.drift_mps is None
    assert found.velocity_covariance_m2ps2 is found.drift_variance_m2ps2 is None
    assert publishable(Solution(NoFix.FIX, found), len(fix.used)).fix is found


def test_a_clock_outside_the_fix_shows_no_instant():
    assert propagated_to_mark(latched(craft(clock_s=(1e-3,))), 2, None) is NoFix.TOO_FEW_SATELLITES


def test_a_way_beyond_the_bus_is_no_fix():
    fix = replace(latched(craft()), position_m=np.array([109_899_999.0, 0.0, 0.0]))
    away = np.array([9_000.0, 0.0, 0.0])
    assert propagated_to_mark(replace(fix, velocity_mps=away), 1, None) is NoFix.NO_CONVERGENCE
    assert isinstance(propagated_to_mark(replace(fix, velocity_mps=-away), 1, None), Fix)


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", OFFSETS_S)
@pytest.mark.parametrize("policy", ["patent", "prototype"])
def test_on_the_bus(policy, offset_s):
    """Whole epochs: from frames to frames, commanded and not."""
    bus = FakeBus(soyuz(clock_s=(offset_s,)), SKY, mark_clock=1)
    _, answers, _ = fly(bus, configure(SOYUZ, policy, {}), 6)
    for t, answer in enumerate(answers):
        pdop = decoded(answer, "NAV_STATUS")["pdop"][0]
        error_m = np.linalg.norm(position_of(answer) - s.truth_ecef(bus.craft, float(t))[0])
        assert error_m < 0.003 * pdop + 0.001  # the steps of the bus


def test_the_same_epochs_under_a_mark_in_gps_time_are_metres_wrong():
    bus = FakeBus(soyuz(clock_s=(1e-3,)), SKY, mark_clock=1)
    bus_of_gps = FakeBus(soyuz(clock_s=(1e-3,)), SKY)
    config = configure(SOYUZ, "prototype", {})
    _, answers, _ = fly(bus, config, 1, tamper=lambda k, _: bus_of_gps.block(k, t=k - 1e-3))
    wrong_m = np.linalg.norm(position_of(answers[0]) - s.truth_ecef(bus.craft)[0])
    assert wrong_m == pytest.approx(7.3, abs=0.3)


def test_rates_that_contradict_each_other_from_the_start_are_no_fix_and_say_why(monkeypatch):
    """Every satellite errs in its own way; once a velocity is known, it is carried on and leads."""
    bus, config = FakeBus(soyuz(clock_s=(1e-3,)), SKY, mark_clock=1), configure(SOYUZ, "prototype", {})
    right = s.rate

    def wrong(c, a, sat, orbit, t):
        return right(c, a, sat, orbit, t) + 50.0 * (sat * 7919 % 11)

    monkeypatch.setattr(s, "rate", wrong)
    states, answers, _ = fly(bus, config, 2)
    assert [status(answer, "no_fix") for answer in answers] == [NoFix.NO_VELOCITY] * 2
    monkeypatch.setattr(s, "rate", right)
    states, *_ = fly(bus, config, 1, states[-1], first=2)
    monkeypatch.setattr(s, "rate", wrong)
    _, answers, _ = fly(bus, config, 1, states[-1], first=3)
    assert status(answers[0], "mode") == 1
    # The velocity known is 2 mm/s wrong by the steps of the bus; what that makes of 1 ms is nothing.
    assert np.linalg.norm(position_of(answers[0]) - s.truth_ecef(bus.craft, 3.0)[0]) < 0.01
