"""Attitude: frames by their definition, rates by finite differences, quaternions by their conventions."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.attitude.profile import build_attitude, lvlh, quintic
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.earth.constants import ROTATION_RPS, eci_to_ecef, rotation_angle_rad
from gnss_hil.emulator.numerics.rotations import dcm_321, dcm_of_quaternion, quaternion_of_dcm
from gnss_hil.emulator.orbits.dynamics import build_orbit

START_NS = gpstime.from_calendar(datetime(2012, 10, 31, 0, 15))
LEAP_S = 16
ORBIT = build_orbit(scenario.Orbit(altitude_km=415, inclination_deg=51.6, eccentricity=0.01), START_NS)
OFFSET = {"roll_deg": 20, "pitch_deg": -35, "yaw_deg": 50}
PROFILE = [
    {"t_s": 10, "roll_deg": 5},
    {"t_s": 100, "roll_deg": 60, "pitch_deg": 30, "yaw_deg": -100},
    {"t_s": 160, "roll_deg": 60, "pitch_deg": 30, "yaw_deg": -100},
    {"t_s": 400},
]
MODES = [
    {"mode": "lvlh"},
    {"mode": "offset", **OFFSET},
    {"mode": "inertial", **OFFSET},
    {"mode": "slew", "profile": PROFILE},
]
angle = st.floats(-np.pi, np.pi)


def at(t_s):
    return START_NS + round(t_s * 1e9)


def attitude_of(**table):
    return build_attitude(scenario.Attitude(**table), START_NS, ORBIT.at(START_NS))


def dcm_body_from_eci(attitude, t_ns):
    quaternion, _ = attitude.at(t_ns, ORBIT.at(t_ns))
    ecef_from_eci = eci_to_ecef(np.eye(3), rotation_angle_rad(t_ns, LEAP_S)).T
    return dcm_of_quaternion(quaternion) @ ecef_from_eci


@pytest.mark.parametrize("table", MODES, ids=lambda table: table["mode"])
@pytest.mark.parametrize("t_s", [0.5, 55.0, 130.0, 300.0, 2000.0])
def test_rates_are_those_of_the_attitude_relative_to_inertial_space(table, t_s):
    """C' = -[w x] C for a passive body-from-inertial matrix: differentiated over 0.1 s."""
    attitude, step_s = attitude_of(**table), 0.05
    before, now, after = (dcm_body_from_eci(attitude, at(t_s + k * step_s)) for k in (-1, 0, 1))
    turning = -(after - before) / (2 * step_s) @ now.T
    numeric = np.array((turning[2, 1], turning[0, 2], turning[1, 0]))
    _, rate = attitude.at(at(t_s), ORBIT.at(at(t_s)))
    assert rate == pytest.approx(numeric, abs=2e-7)


def test_lvlh_axes():
    """z to the Earth's centre, y against the orbital momentum of inertial motion, x close to the velocity."""
    state = ORBIT.at(at(1000))
    frame, _ = lvlh(state)
    vel = state.vel_ecef_mps + np.cross((0, 0, ROTATION_RPS), state.pos_ecef_m)
    momentum = np.cross(state.pos_ecef_m, vel)
    assert frame[2] == pytest.approx(-state.pos_ecef_m / np.linalg.norm(state.pos_ecef_m), abs=1e-15)
    assert frame[1] == pytest.approx(-momentum / np.linalg.norm(momentum), abs=1e-15)
    assert frame[0] @ vel / np.linalg.norm(vel) > np.cos(0.011)
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1)


def test_lvlh_attitude_is_the_orbital_frame():
    quaternion, rate = attitude_of(mode="lvlh").at(at(77), ORBIT.at(at(77)))
    frame, _ = lvlh(ORBIT.at(at(77)))
    assert dcm_of_quaternion(quaternion) == pytest.approx(frame, abs=1e-14)
    assert rate[1] == pytest.approx(-2 * np.pi / 5600, rel=0.03)  # pitches down once an orbit


def test_a_craft_rolled_to_starboard_sees_starboard_where_nadir_was():
    """Roll +90 deg: body z, nadir before, points to port (-y of the orbital frame); body y to nadir."""
    quaternion, _ = attitude_of(mode="offset", roll_deg=90).at(START_NS, ORBIT.at(START_NS))
    body_from_lvlh = dcm_of_quaternion(quaternion) @ lvlh(ORBIT.at(START_NS))[0].T
    y_body, z_body = body_from_lvlh[1], body_from_lvlh[2]
    assert y_body == pytest.approx((0, 0, 1), abs=1e-14)
    assert z_body == pytest.approx((0, -1, 0), abs=1e-14)


def test_inertial_attitude_stays_and_starts_as_the_offset():
    fixed, moving = attitude_of(mode="inertial", **OFFSET), attitude_of(mode="offset", **OFFSET)
    first = dcm_body_from_eci(fixed, START_NS)
    assert first == pytest.approx(dcm_body_from_eci(moving, START_NS), abs=1e-14)
    assert dcm_body_from_eci(fixed, at(4000)) == pytest.approx(first, abs=1e-11)


def test_slew_goes_through_its_turns_and_rests_at_them():
    slew = attitude_of(mode="slew", profile=PROFILE)
    for t_s, angles in (
        (0, (5, 0, 0)),
        (10, (5, 0, 0)),
        (100, (60, 30, -100)),
        (130, (60, 30, -100)),
        (500, (0, 0, 0)),
    ):
        state = ORBIT.at(at(t_s))
        quaternion, rate = slew.at(at(t_s), state)
        frame, frame_rate = lvlh(state)
        expected = dcm_321(*np.radians(angles))
        assert dcm_of_quaternion(quaternion) @ frame.T == pytest.approx(expected, abs=1e-13)
        assert rate == pytest.approx(expected @ frame_rate, abs=1e-12)


def test_quintic_is_smooth():
    x = np.linspace(0, 1, 1001)
    value, slope = np.array([quintic(v) for v in x]).T
    assert quintic(0) == (0, 0) and quintic(1) == (1, 0)
    assert np.diff(value).min() >= 0
    assert np.gradient(value, x)[1:-1] == pytest.approx(slope[1:-1], abs=2e-5)
    assert np.gradient(slope, x)[[0, -1]] == pytest.approx(
        0, abs=0.04
    )  # acceleration starts and ends at rest


@given(angle, angle, angle)
def test_321_matrix_is_scipys(roll, pitch, yaw):
    """scipy's intrinsic z-y'-x'' is the same turn as an active rotation: its inverse turns coordinates."""
    expected = Rotation.from_euler("ZYX", (yaw, pitch, roll)).inv().as_matrix()
    assert dcm_321(roll, pitch, yaw) == pytest.approx(expected, abs=1e-12)


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternion_and_matrix_are_inverse_of_each_other(parts):
    quaternion = np.array(parts) / np.linalg.norm(parts)
    dcm = dcm_of_quaternion(quaternion)
    w, x, y, z = quaternion
    assert dcm == pytest.approx(Rotation.from_quat((x, y, z, w)).inv().as_matrix(), abs=1e-12)
    back = quaternion_of_dcm(dcm)
    assert back[0] >= 0
    assert abs(back @ quaternion) == pytest.approx(1, abs=1e-14)
    assert dcm_of_quaternion(back) == pytest.approx(dcm, abs=1e-12)
