"""Attitudes that a craft cannot have turned to, and how far one that was turned on is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.flightsw.attitude.attitude import HELD_RPS, NOT_TURNED_RAD, attitude_now, levers_ecef
from gnss_hil.flightsw.estimation.all_in_view import all_in_view
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.position import Held
from gnss_hil.flightsw.estimation.snapshot import Snapshot
from gnss_hil.flightsw.records.epoch import AttitudeReport
from tests.support import synthetic_epochs as s
from tests.support.budgets import BUDGET
from tests.support.fixes import LEVERS, RATE, SKY, craft, fix_of, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/attitude/attitude.py",
    what="Attitude that is not believed, and one that is held",
    by="SciPy rotations of known angles; drawn attitude errors, through the lever arms",
    status="validated",
)

DCM = craft().dcm_body_from_eci
HOLD = 5


def report(t=0.0, off_rad=(0.0, 0.0, 0.0), faster_rps=(0.0, 0.0, 0.0)):
    """At t, of a body that turns faster since 0, and off about its axes."""
    turned = s.turned(DCM, RATE + 0.5 * np.asarray(faster_rps), t)
    dcm = Rotation.from_rotvec(off_rad).as_matrix().T @ turned @ s.ecef_from_eci(t).T
    return AttitudeReport(s.quaternion(dcm), RATE + faster_rps)


def then(reported, t=1.0, last=None, hold=HOLD):
    """The attitude of t after a report of 0, or after what was last."""
    first = attitude_now(report(), None, s.T0_NS, hold) if last is None else last
    return attitude_now(reported, first, s.T0_NS + round(t * 1e9), hold)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("angle_rad", "believed"),
    [(0.0, True), (0.019, True), (0.021, False), (np.pi / 2, False), (np.pi, False)],
)
def test_a_report_off_by_more_than_sensors_err_is_not_believed(axis, angle_rad, believed):
    said = report(1.0, angle_rad * np.eye(3)[axis])
    now = then(said)
    assert NOT_TURNED_RAD == 0.02 and (now.age == 0) == believed
    if not believed:
        assert np.array_equal(now.dcm_body_from_ecef, then(None).dcm_body_from_ecef)


@pytest.mark.parametrize("dt_s", [0.1, 1.0, 10.0])
def test_a_craft_that_begins_to_turn_is_believed(dt_s):
    """Its rate changes to 6 degrees a second, evenly or all at once."""
    faster = np.array([0.1, -0.02, 0.03])
    steady = then(report(dt_s, faster_rps=faster), dt_s)
    at_once = s.turned(DCM, RATE + faster, dt_s) @ s.ecef_from_eci(dt_s).T
    sudden = then(AttitudeReport(s.quaternion(at_once), RATE + faster), dt_s)
    assert steady.age == sudden.age == 0


def test_an_attitude_that_lasts_is_believed_when_the_last_one_may_be_held_no_longer():
    """The body lies another way than it was said to at first."""
    now, ages = None, []
    for k in range(1, HOLD + 3):
        q = s.quaternion(Rotation.from_rotvec((np.pi, 0, 0)).as_matrix() @ DCM @ s.ecef_from_eci(k).T)
        now = then(AttitudeReport(q, np.zeros(3)), k, now)
        ages.append(now.age)
    assert ages == [1, 2, 3, 4, 5, 0, 0]


SLOW = 0.05 * RATE
"""As fast as a craft turns that keeps looking down from a low orbit."""


def ages(*reports):
    return [now.age for now in attitudes(*reports)]


def attitudes(body_s, rates, seconds, hold=200):
    """By a report a second: of the body turned at SLOW for body_s(k), with rates(k)."""
    now, found = None, []
    for k in range(seconds):
        dcm = s.turned(DCM, SLOW, body_s(k)) @ s.ecef_from_eci(body_s(k)).T
        now = then(AttitudeReport(s.quaternion(dcm), rates(k)), k, now or attitude_of(0.0), hold)
        found.append(now)
    return found


def attitude_of(t):
    return attitude_now(AttitudeReport(report(t).quaternion_body_from_ecef, SLOW), None, s.T0_NS, HOLD)


def test_one_attitude_again_and_again_is_not_believed_of_a_craft_that_says_it_turns():
    per_s = np.linalg.norm(SLOW)
    assert np.degrees(per_s) == pytest.approx(0.066, abs=1e-3)
    for stuck_s in (3, 29, 40):
        found = ages(lambda k, stuck_s=stuck_s: min(k, stuck_s), lambda _: SLOW, 100)
        first = next(k for k, age in enumerate(found) if age)
        assert NOT_TURNED_RAD / per_s < first - stuck_s < NOT_TURNED_RAD / per_s + 30
        assert all(found[first:])
    back = attitudes(lambda k: 10 if 10 < k < 70 else k, lambda _: SLOW, 90)
    assert back[40].age > 0 and not any(now.age for now in back[70:])
    true = s.turned(DCM, SLOW, 40.0) @ s.ecef_from_eci(40.0).T
    assert back[40].dcm_body_from_ecef == pytest.approx(true, abs=1e-9)  # by its rates


def test_rates_of_a_poor_gyro_are_no_contradiction():
    """Off by 0.02 degrees a second, or noisy."""
    off = np.radians([0.02, 0.0, 0.0])
    assert not any(ages(lambda k: k, lambda _: SLOW + off, 200))
    noise = np.random.default_rng(4).normal(size=(200, 3)) * np.radians(0.05)
    assert not any(ages(lambda k: k, lambda k: SLOW + noise[k], 200))


def test_an_attitude_turned_on_is_known_the_worse_the_longer():
    now = None
    for k in range(1, 4):
        now = then(None, k, now)
        assert (now.age, now.sigma_rad, now.rate_sigma_rps) == (k, pytest.approx(k * HELD_RPS), HELD_RPS)
    fresh = then(report(4.0), 4.0, now)
    assert (fresh.age, fresh.sigma_rad, fresh.rate_sigma_rps) == (0, 0.0, 0.0)


def test_what_it_is_known_worse_is_in_the_fix():
    """Against attitudes drawn about the one held: what levers of tens of metres then add to ranges and rates,
    which have hardly another error."""
    c = craft(levers=10 * LEVERS)
    m = measurements(s.observe(c, in_view(c, 6, sats=[sat for sat in SKY if sat < 64]), SKY), cn0=70.0)
    rng, held, n = np.random.default_rng(3), Held(0.05, 0.01), 40_000
    lever, _ = levers_ecef(then(None, 0.0), c.lever_body)
    away = m.pos_sv_m.T - s.truth_ecef(c)[0]
    towards = away / np.linalg.norm(away, axis=1)[:, None]

    def shorter(sigma):
        """(satellites, n) of attitudes or rates drawn."""
        turned = np.cross(sigma * rng.normal(size=(n, 1, 3)), lever[m.receiver])
        return (turned * towards).sum(axis=2).T

    right, said = fix_of(c, m), fix_of(c, m, held=held)
    assert np.array_equal(right.used, said.used)
    for covariance, least, gain, drawn, own in (
        (said.covariance_m2, right.covariance_m2, said.gain, shorter(held.sigma_rad),
         m.code_variance_m2 + m.space_sigma_m**2),
        (said.velocity_covariance_m2ps2, right.velocity_covariance_m2ps2, said.velocity_gain,
         shorter(held.rate_sigma_rps), m.rate_variance_m2ps2),
    ):  # fmt: skip
        expected = gain @ (np.cov(drawn) + np.diag(own)) @ gain.T
        assert covariance == pytest.approx(expected, abs=0.05 * np.trace(expected))
        assert np.trace(covariance) > 1.2 * np.trace(least)


def test_a_navigator_knows_that_the_attitude_is_held():
    """Levers of 20 m by an attitude of three degrees: their errors are in what it says of its fix."""
    c = craft(levers=10 * LEVERS)
    m = measurements(s.observe(c, in_view(c, 6, sats=[sat for sat in SKY if sat < 64]), SKY), cn0=70.0)
    fresh = then(report(), 0.0)
    held = replace(fresh, age=5, sigma_rad=0.05, rate_sigma_rps=0.01)
    found = [all_in_view(m, FixInputs(one, c.lever_body, c.domain, BUDGET), Snapshot())[0]
             for one in (fresh, held)]  # fmt: skip
    for name in ("covariance_m2", "velocity_covariance_m2ps2"):
        right, said = (np.trace(getattr(fix, name)) for fix in found)
        assert said > 1.2 * right, name
