"""Attitudes that a craft cannot have turned to, and how far one that was turned on is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gnss_hil.flightsw.attitude.attitude import HELD_RPS, NOT_TURNED_RAD, attitude_now, levers_ecef
from gnss_hil.flightsw.estimation.position import Held
from gnss_hil.flightsw.records.epoch import AttitudeReport
from tests.flightsw.estimation.test_position import LEVERS, RATE, SKY, craft, fix_of, in_view, measurements
from tests.support import synthetic_epochs as s

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
