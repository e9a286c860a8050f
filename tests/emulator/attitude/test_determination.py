"""Attitude as known: closed-form growth, the settled filter by a Riccati solver, rotations by SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.spatial.transform import Rotation

from gnss_hil.emulator.attitude import determination as a
from gnss_hil.emulator.error_models.attitude_error import AttitudeError, sensors
from gnss_hil.emulator.numerics.keyed_draws import Stream
from gnss_hil.emulator.numerics.rotations import dcm_of_quaternion, quaternion_of_dcm

DEG = np.pi / 180
S = 10**9

CASES = [
    AttitudeError(),
    AttitudeError(angle_walk_deg_rth=0.1, drift_walk_deg_h_rth=2.0, star_interval_s=10, star_sigma_arcsec=30),
    AttitudeError(
        angle_walk_deg_rth=0.0, drift_walk_deg_h_rth=1.0, star_interval_s=600, star_sigma_arcsec=60
    ),
]


def riccati(parameters):
    """Gains (2,) and covariance after a fix (2, 2) by SciPy; state: attitude error, unknown drift."""
    t = parameters.star_interval_s
    arw2 = (parameters.angle_walk_deg_rth * DEG) ** 2 / 3600
    rrw2 = (parameters.drift_walk_deg_h_rth * DEG / 3600) ** 2 / 3600
    star2 = (parameters.star_sigma_arcsec * DEG / 3600) ** 2
    f, h = np.array(((1.0, t), (0.0, 1.0))), np.array(((1.0, 0.0),))
    q = np.array(((arw2 * t + rrw2 * t**3 / 3, rrw2 * t**2 / 2), (rrw2 * t**2 / 2, rrw2 * t)))
    scale = np.diag((1e5, 1e8))  # keeps the solver away from its rounding
    f, q, h = scale @ f @ np.linalg.inv(scale), scale @ q @ scale, h @ np.linalg.inv(scale) * 1e5
    before = solve_discrete_are(f.T, h.T, q, np.array(((star2 * 1e10,),)))
    gain = before @ h.T / (h @ before @ h.T + star2 * 1e10)
    after = (np.eye(2) - gain @ h) @ before
    back = np.linalg.inv(scale)
    return (back @ gain * 1e5).ravel(), back @ after @ back


@pytest.mark.verifies(
    "emulator/attitude/determination.py",
    "emulator/error_models/attitude_error.py",
    what="Attitude as the computer knows it: gyros and star sensor",
    by=(
        "SciPy's Riccati solver: gains to 1e-6, covariance to 1e-5; growth without stars against ARW^2 t + "
        "RRW^2 t^3 / 3; SciPy rotations"
    ),
    status="validated",
)
@pytest.mark.parametrize("parameters", CASES)
def test_gains_and_covariance_are_those_of_the_riccati_equation(parameters):
    gains, after = riccati(parameters)
    parts = sensors(parameters, S)
    assert (parts.angle_gain, parts.drift_gain) == pytest.approx(gains, rel=1e-6)
    assert parts.initial @ parts.initial.T == pytest.approx(after, rel=1e-5)


def play(parameters, epochs, seeds, interval_ns=S):
    """Angles and rates (seeds, epochs, 3)."""
    parts, angles, rates = sensors(parameters, interval_ns), [], []
    for seed in range(seeds):
        state, path = None, []
        for epoch in range(epochs):
            state = a.estimated(parts, state, Stream(seed, 77, "attitude_error"), epoch)
            path.append((state.angle_rad, state.rate_rps))
        angles.append([angle for angle, _ in path])
        rates.append([rate for _, rate in path])
    return np.array(angles), np.array(rates)


def test_without_stars_attitude_runs_away_as_the_textbook_says():
    """sigma^2 = ARW^2 t + RRW^2 t^3 / 3, from a start without error."""
    free = AttitudeError(
        angle_walk_deg_rth=0.05,
        drift_walk_deg_h_rth=4.0,
        star_interval_s=0,
        initial_deg=0,
        initial_drift_deg_h=0,
    )
    angles, _ = play(free, 61, 300, 10 * S)
    arw, rrw = 0.05 * DEG / 60, 4.0 * DEG / 3600 / 60
    for t in (10.0, 100.0, 600.0):
        expected = np.sqrt(arw**2 * t + rrw**2 * t**3 / 3)
        assert angles[:, int(t / 10)].std() == pytest.approx(expected, rel=0.08)


def test_an_unknown_drift_turns_the_attitude_at_its_rate():
    """1 deg/h for an hour is one degree, the sense of the drift."""
    still = AttitudeError(angle_walk_deg_rth=0, drift_walk_deg_h_rth=0, star_interval_s=0)
    parts, drift = sensors(still, 60 * S), np.array((1.0, -2.0, 0.5)) * DEG / 3600
    state = a.Knowledge(np.zeros(3), drift, drift)
    for epoch in range(1, 61):
        state = a.advance(parts, state, np.zeros((3, 3)), epoch)
    assert state.angle_rad == pytest.approx(3600 * drift)
    assert state.rate_rps == pytest.approx(drift)


@pytest.mark.parametrize("parameters", CASES[:2])
def test_errors_scatter_as_the_settled_filter_says(parameters):
    """From the first epoch on, over the sensor's: ratio^2 - 1 before a fix, 1 - 1 / ratio^2 after it."""
    epochs = int(parameters.star_interval_s)
    angles, _ = play(parameters, 3 * epochs + 1, 120)
    _, after = riccati(parameters)
    parts = sensors(parameters, S)
    for epoch in (0, epochs, 3 * epochs):
        assert angles[:, epoch].std() == pytest.approx(np.sqrt(after[0, 0]), rel=0.12)
    ratio = a.settled(parts.white, parts.walk, parts.star_rad, parameters.star_interval_s)
    t, white, walk = parts.dt_s, parts.white, parts.walk
    f = np.array(((1.0, (epochs - 1) * t), (0.0, 1.0)))
    grown = f @ after @ f.T
    grown[0, 0] += white * (epochs - 1) * t + walk * ((epochs - 1) * t) ** 3 / 3
    assert angles[:, 3 * epochs - 1].std() == pytest.approx(np.sqrt(grown[0, 0]), rel=0.12)
    assert grown[0, 0] < (ratio**2 - 1) * parts.star_rad**2


def test_star_fixes_find_the_drift_of_the_gyros():
    """A hundred times its settled scatter at first; after three hours of fixes attitude and drift scatter as
    the Riccati equation says, and nothing of the first drift is left in them."""
    parameters = AttitudeError()
    _, after = riccati(parameters)
    parts = sensors(parameters, 10 * S)
    sigma_rad, sigma_rps = np.sqrt(np.diag(after))
    for seed in range(4):
        state = a.estimated(parts, None, Stream(seed, 77, "attitude_error"), 0)
        state = replace(state, drift_rps=state.drift_rps + 100 * sigma_rps)
        for epoch in range(1, 1081):
            state = a.estimated(parts, state, Stream(seed, 77, "attitude_error"), epoch)
        assert np.abs(state.angle_rad).max() < 5 * sigma_rad
        assert np.abs(state.drift_rps).max() < 5 * sigma_rps


def test_reported_rates_carry_drift_and_noise():
    """White noise of rate averaged over an epoch: ARW / sqrt(dt)."""
    noisy = AttitudeError(
        angle_walk_deg_rth=0.6, drift_walk_deg_h_rth=0, star_interval_s=0, initial_drift_deg_h=0
    )
    _, rates = play(noisy, 400, 4)
    assert rates[:, 1:].std() == pytest.approx(0.6 * DEG / 60, rel=0.03)


def test_estimated_axes_are_the_true_ones_turned():
    """By SciPy: body axes, as vectors in ECEF, turned about a vector fixed in them."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        body_from_ecef = Rotation.random(random_state=rng.integers(1 << 31))
        angle = rng.normal(size=3) * rng.choice((1e-9, 1e-4, 0.3))
        axes = body_from_ecef.inv()  # takes components in body axes to ecef: its columns are the axes
        turned = axes * Rotation.from_rotvec(angle)
        quaternion = quaternion_of_dcm(body_from_ecef.as_matrix())
        found = a.reported_quaternion(quaternion, angle)
        assert dcm_of_quaternion(found) == pytest.approx(turned.inv().as_matrix(), abs=1e-14)
        assert found[0] >= 0
        assert found @ found == pytest.approx(1, abs=1e-14)


def test_no_noise_at_all_is_no_error():
    perfect = AttitudeError(angle_walk_deg_rth=0, drift_walk_deg_h_rth=0)
    angles, rates = play(perfect, 130, 2)
    assert not angles.any()
    assert not rates.any()
