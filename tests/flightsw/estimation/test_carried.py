"""Positions carried on by velocities: where they lead, how far that is known, what they contradict.

The way of the craft is the two-body orbit of an integrator of scipy's, with and without an engine.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gnss_hil.flightsw.estimation import carried
from gnss_hil.flightsw.estimation.carried import BEGUN_S, GAP_S, begun, carried_on, gone_astray
from gnss_hil.flightsw.estimation.prior import ACCELERATION_MPS2
from gnss_hil.flightsw.records.solution import Tested as Word
from gnss_hil.flightsw.records.solution import without_motion
from tests.support import synthetic_epochs as s
from tests.support.fixes import SKY, craft, fix_of, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/carried.py",
    what="Positions carried on by velocities, as judges of the fixes",
    by="an integrator of scipy's, engines and slow faults along its orbit; drawn errors of velocities",
    status="validated",
)

MU, TURN_RPS, J2, EQUATOR_M = 3.986004418e14, 7.2921151467e-5, 1.08262668e-3, 6378137.0
RNG = np.random.default_rng(3)
FIX = fix_of(craft(), measurements(s.observe(craft(), in_view(craft(), 12), SKY)))
"""For its covariances."""


def flight(seconds: int, engine_mps2=0.0, from_s=0.0, to_s=0.0):
    """Position and velocity (n, 3), Greenwich frame, each second; the engine pushes along the way."""

    def rate(t, y):
        r, v = y[:3], y[3:]
        d = np.linalg.norm(r)
        z2 = 5 * r[2] ** 2 / d**2
        pull = -MU / d**3 * r * (1 + 1.5 * J2 * (EQUATOR_M / d) ** 2 * (np.array([1, 1, 3]) - z2))
        turn = np.array(
            [TURN_RPS**2 * r[0] + 2 * TURN_RPS * v[1], TURN_RPS**2 * r[1] - 2 * TURN_RPS * v[0], 0]
        )
        push = engine_mps2 * v / np.linalg.norm(v) if from_s <= t < to_s else 0.0
        return np.concatenate((v, pull + turn + push))

    at, y = np.arange(seconds + 1.0), np.concatenate(s.truth_ecef(craft()))
    found = solve_ivp(rate, (0, seconds), y, "DOP853", t_eval=at, rtol=1e-12, atol=1e-6, max_step=0.5)
    return found.y[:3].T, found.y[3:].T


def fix_at(position, velocity, **more):
    return replace(FIX, position_m=position, velocity_mps=velocity, **{"tested": Word.TESTED, **more})


def ns(t_s: float) -> int:
    return s.T0_NS + round(t_s * 1e9)


def flown(positions, velocities, step=1, **more):
    """Ways after each fix of a flight, and which of them it contradicts."""
    ways, every, astray = (), [], []
    for k in range(0, len(positions), step):
        fix = fix_at(positions[k], velocities[k], **more)
        ways = carried_on(ways, ns(k), fix)
        astray.append(gone_astray(ways, ns(k), fix))
        ways = begun(ways, ns(k), fix)
        every.append(ways)
    return every, astray


@pytest.mark.parametrize(("step", "off_m"), [(1, 1e-3), (10, 1e-3), (30, 2e-2)])
def test_velocities_lead_along_the_orbit(step, off_m):
    positions, velocities = flight(300)
    ways, astray = flown(positions, velocities, step)
    assert not any(astray)
    last = ways[-1][0]
    assert last.age_s >= BEGUN_S
    assert np.linalg.norm(last.position_m - positions[-1]) < off_m


def test_they_tell_of_engines_that_no_orbit_knows_of():
    """Five times as strong as an engine is taken for, for twenty seconds: 300 m aside in the end."""
    positions, velocities = flight(120, 5 * ACCELERATION_MPS2, 40.0, 60.0)
    ways, astray = flown(positions, velocities)
    assert not any(astray)
    assert np.linalg.norm(positions - flight(120)[0], axis=1)[-1] > 2000
    assert np.linalg.norm(ways[-1][0].position_m - positions[-1]) < 0.3


@pytest.mark.parametrize(("ramp_mps", "within_s"), [(1.0, 20), (3.0, 10)])
def test_a_position_that_moves_otherwise_than_it_says_contradicts_them(ramp_mps, within_s):
    positions, velocities = flight(100)
    slow = positions + ramp_mps * np.maximum(np.arange(101) - 40, 0)[:, None] * np.array([0.6, 0.0, 0.8])
    _, astray = flown(slow, velocities)
    first = next(k for k, ways in enumerate(astray) if ways)
    assert 40 < first <= 40 + within_s


def test_it_is_as_uncertain_as_velocities_are_whose_errors_last():
    positions, velocities = flight(60)
    spread = np.array([[4.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]]) * 1e-2
    drawn = np.linalg.cholesky(spread) @ RNG.normal(size=(3, 4000))
    (way,) = flown(positions, velocities, velocity_covariance_m2ps2=spread)[0][-1]
    assert way.now_m2 - FIX.covariance_m2 == pytest.approx(np.cov(60 * drawn), rel=0.1, abs=4.0)
    assert way.bent_m2 == pytest.approx(60 * (ACCELERATION_MPS2 / 12) ** 2)


def test_two_are_on_their_way_and_the_older_is_five_minutes_old_at_most():
    ways, _ = flown(*flight(700))
    ages = [[way.age_s for way in at] for at in ways]
    assert max(map(len, ages)) == 2
    assert max(max(at) for at in ages) == 2 * BEGUN_S - 1
    assert min(max(at) for at in ages[int(BEGUN_S) :]) >= BEGUN_S - 1


def test_nothing_is_carried_on_over_a_long_gap_or_back():
    position, velocity = (one[0] for one in flight(1))
    fix = fix_at(position, velocity)
    ways = begun((), ns(0), fix)
    assert carried_on(ways, ns(GAP_S), fix) and not carried_on(ways, ns(GAP_S + 1), fix)
    assert not carried_on(ways, ns(-1), fix)


def test_without_a_velocity_it_waits_and_judges_nothing():
    position, velocity = (one[0] for one in flight(1))
    ways = begun((), ns(0), fix_at(position, velocity))
    far = without_motion(fix_at(position + 1e4, velocity))
    assert carried_on(ways, ns(5), far) == ways
    assert not gone_astray(ways, ns(5), far)
    assert begun((), ns(0), far) == ()


def test_none_begins_where_nothing_could_contradict_the_fix():
    position, velocity = (one[0] for one in flight(1))
    assert begun((), ns(0), fix_at(position, velocity, tested=Word.UNTESTED)) == ()


def test_a_fix_that_is_tested_need_not_follow_from_one_that_was_not():
    positions, velocities = flight(2)
    for was, now, told in (
        (Word.CHECKED, Word.TESTED, False),
        (Word.CHECKED, Word.CHECKED, True),
        (Word.TESTED, Word.TESTED, True),
        (Word.TESTED, Word.CHECKED, True),
    ):
        ways = begun((), ns(0), fix_at(positions[0] + 1e3, velocities[0], tested=was))
        fix = fix_at(positions[1], velocities[1], tested=now)
        assert bool(gone_astray(carried_on(ways, ns(1), fix), ns(1), fix)) == told


def test_as_an_orbit_it_is_where_velocities_led():
    positions, velocities = flight(10)
    way = flown(positions, velocities)[0][-1][0]
    orbit = way.orbit
    assert orbit.fix_ns == orbit.t_ns == way.t_ns and orbit.checked
    assert np.array_equal(orbit.position_m, way.position_m)
    assert np.array_equal(orbit.covariance_m2, way.now_m2)
    assert orbit.velocity_covariance_m2ps2 == pytest.approx(FIX.velocity_covariance_m2ps2)
    assert carried.GAP_S < carried.BEGUN_S
