"""What snapshot navigators keep from epoch to epoch: the orbit, propagated while that is worth anything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.registry import NAVIGATORS
from gnss_hil.flightsw.estimation.snapshot import MAX_COAST_S, Snapshot, SnapshotNavigator, coasted
from gnss_hil.flightsw.integrity.exclusion import STRICT, Rules
from gnss_hil.flightsw.orbit.propagator import propagate
from gnss_hil.flightsw.records.solution import NoFix, OrbitState
from gnss_hil.flightsw.records.solution import Tested as Word
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET
from tests.support.fixes import SKY, craft, fix_of, in_view, measurements

POSITION, VELOCITY = s.truth_ecef(craft())


def orbit(velocity=VELOCITY):
    return OrbitState(s.T0_NS, POSITION, velocity, s.T0_NS)


def later(dt_s):
    return s.T0_NS + round(dt_s * 1e9)


@pytest.mark.parametrize(
    ("dt_s", "known"),
    [(0.0, True), (1.0, True), (3600.0, True), (3600.1, False), (90_000.0, False), (-1.0, False)],
)
def test_a_position_is_forgotten_an_hour_after_the_last_fix(dt_s, known):
    now = coasted(orbit(), later(dt_s))
    assert MAX_COAST_S == 3600.0 and (now is not None) == known
    if known:
        position, velocity = propagate(POSITION, VELOCITY, dt_s)
        assert np.array_equal(now.position_m, position) and np.array_equal(now.velocity_mps, velocity)
        assert (now.t_ns, now.fix_ns) == (later(dt_s), s.T0_NS)


@pytest.mark.parametrize("step_s", [10.0, 100.0, 3600.0])
def test_the_hour_runs_on_whether_epochs_come_or_not(step_s):
    """Epochs that bring no fix move the position on; they do not make it younger."""
    navigator = NAVIGATORS["all_in_view"].build({})
    state, epochs = Snapshot(orbit()), round(3600.0 / step_s)
    for epoch in range(1, epochs + 1):
        state = navigator.predict(state, later(epoch * step_s))
        assert state.orbit is not None and state.orbit.fix_ns == s.T0_NS
    state = navigator.predict(state, later(3600.0 + step_s))
    assert state.orbit is None and state.start_m is None


def test_time_that_goes_back_leaves_no_position():
    assert coasted(OrbitState(later(10.0), POSITION, VELOCITY, s.T0_NS), later(9.0)) is None


def test_a_position_without_velocity_is_forgotten_at_once():
    assert coasted(orbit(None), s.T0_NS + 10**9) is None and coasted(None, s.T0_NS) is None


def test_the_search_starts_where_the_craft_is_expected():
    assert Snapshot().start_m is None
    assert np.array_equal(Snapshot(orbit()).start_m, POSITION)


@pytest.mark.parametrize(
    ("judged", "clock", "rules", "believed"),
    [
        (False, 0, STRICT, False),
        (True, 0, STRICT, True),  # by its own solution, here none
        (True, 1, STRICT, False),
        (False, 0, Rules(refuse=False), True),
    ],
)
def test_a_fix_that_is_not_where_the_craft_must_be_is_none(judged, clock, rules, believed):
    c = craft()
    z = measurements(s.observe(c, in_view(c, 12), SKY))
    fix = fix_of(c, z)
    far = replace(fix, position_m=fix.position_m + np.array([1000.0, 0.0, 0.0]))
    for found, right in ((fix, True), (far, believed)):
        navigator = SnapshotNavigator(lambda *_, found=found: (found, -1), judged=judged)
        known = OrbitState(s.T0_NS, POSITION, VELOCITY, s.T0_NS - 10**9, np.eye(3), np.eye(3), 10.0)
        inputs = FixInputs(None, np.zeros((4, 3)), np.zeros(4, int), BUDGET, rules=rules, mark_clock=clock)
        _, solution = navigator.update(Snapshot(known, t_ns=s.T0_NS), z, inputs)
        assert solution.reason is (NoFix.FIX if right else NoFix.AGAINST_ORBIT)


def test_the_orbit_of_a_fix_that_is_misfit_is_known_the_worse():
    c = craft()
    z = measurements(s.observe(c, in_view(c, 12), SKY))
    fix = replace(fix_of(c, z), misfit=9.0)
    inputs = FixInputs(None, np.zeros((4, 3)), np.zeros(4, int), BUDGET, rules=Rules(refuse=False))
    navigator = SnapshotNavigator(lambda *_: (fix, -1))
    state, _ = navigator.update(Snapshot(t_ns=s.T0_NS), z, inputs)
    assert state.orbit.covariance_m2 == pytest.approx(9.0 * fix.covariance_m2)


def test_an_orbit_bears_witness_if_anything_did_for_its_fix():
    c = craft()
    z = measurements(s.observe(c, in_view(c, 12), SKY))
    inputs = FixInputs(None, np.zeros((4, 3)), np.zeros(4, int), BUDGET, rules=STRICT)
    for word in Word:
        fix = replace(fix_of(c, z), tested=word)
        navigator = SnapshotNavigator(lambda *_, fix=fix: (fix, -1))
        state, _ = navigator.update(Snapshot(t_ns=s.T0_NS), z, inputs)
        assert state.orbit.checked == (word > Word.UNTESTED)
        assert coasted(state.orbit, later(5.0)).checked == state.orbit.checked


def test_time_that_goes_back_takes_nothing_from_how_long_delays_were_not_learnt():
    """A first mark 1,024 weeks ahead is got rid of: else nothing would be learnt for 20 years."""
    navigator = NAVIGATORS["all_in_view"].build({})
    ahead = Snapshot(t_ns=s.T0_NS + 1024 * 604_800 * 10**9, unlearnt_s=5.0, left_out_s=np.array([0.0, 7.0]))
    state = navigator.predict(ahead, s.T0_NS)
    assert (state.unlearnt_s, state.left_out_s.tolist()) == (5.0, [0.0, 7.0])
    assert navigator.predict(state, later(2.0)).unlearnt_s == 7.0


def test_a_mark_in_doubt_makes_the_orbit_before_as_uncertain():
    """For navigators that ask it themselves."""
    c, asked = craft(), []
    z = measurements(s.observe(c, in_view(c, 12), SKY))
    navigator = SnapshotNavigator(
        lambda z, inputs, state: (asked.append(state.orbit) or fix_of(c, z), -1), judged=True
    )
    known = OrbitState(s.T0_NS, POSITION, VELOCITY, s.T0_NS, np.eye(3), np.eye(3), 10.0)
    inputs = FixInputs(None, np.zeros((4, 3)), np.zeros(4, int), BUDGET, rules=STRICT, mark_doubt_s=5e-4)
    navigator.update(Snapshot(known, t_ns=s.T0_NS), z, inputs)
    assert np.trace(asked[0].covariance_m2) - 3.0 == pytest.approx(25e-8 * VELOCITY @ VELOCITY, rel=1e-6)


@pytest.mark.parametrize("judged", [True, False])
@pytest.mark.parametrize("refuse", [True, False])
def test_a_fix_that_is_astray_from_where_velocities_led_is_none(refuse, judged):
    """Where no satellite is to blame, and unless a fix is wanted all the same."""
    c = craft()
    z = measurements(s.observe(c, in_view(c, 12), SKY))
    fix = replace(fix_of(c, z), tested=Word.TESTED)
    inputs = FixInputs(None, np.zeros((4, 3)), np.zeros(4, int), BUDGET, rules=Rules(refuse=refuse))
    after, _ = SnapshotNavigator(lambda *_: (fix, -1)).update(Snapshot(t_ns=s.T0_NS), z, inputs)
    (way,) = after.ways
    assert way.begun_ns == s.T0_NS
    far = replace(fix, position_m=fix.position_m + fix.velocity_mps + np.array([100.0, 0.0, 0.0]))
    later_on = replace(after, orbit=None, t_ns=later(1.0))
    _, solution = SnapshotNavigator(lambda *_: (far, -1), judged=judged).update(later_on, z, inputs)
    assert solution.reason is (NoFix.AGAINST_ORBIT if refuse else NoFix.FIX)


def test_a_fix_at_a_mark_in_doubt_is_uncertain_along_its_way_and_does_not_contradict_the_orbit():
    """Half a millisecond: 3.8 m."""
    c = craft()
    z = measurements(s.observe(c, in_view(c, 12), SKY))
    fix, doubt_s = fix_of(c, z), 5e-4
    along = fix.velocity_mps / np.linalg.norm(fix.velocity_mps)
    late = replace(fix, position_m=fix.position_m + fix.velocity_mps * doubt_s)
    navigator = SnapshotNavigator(lambda *_: (late, -1))
    sure = 0.01 * np.eye(3)
    known = OrbitState(s.T0_NS, fix.position_m, fix.velocity_mps, s.T0_NS, sure, sure, 10.0)
    inputs = FixInputs(None, np.zeros((4, 3)), np.zeros(4, int), BUDGET, rules=STRICT)
    assert navigator.update(Snapshot(known, t_ns=s.T0_NS), z, inputs)[1].reason is NoFix.AGAINST_ORBIT
    doubted = replace(inputs, mark_doubt_s=doubt_s)
    _, solution = navigator.update(Snapshot(known, t_ns=s.T0_NS), z, doubted)
    more = along @ (solution.fix.covariance_m2 - fix.covariance_m2) @ along
    assert more == pytest.approx((np.linalg.norm(fix.velocity_mps) * doubt_s) ** 2, rel=1e-6)
