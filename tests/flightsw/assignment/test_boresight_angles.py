"""Attitude, boresights, angles, blockage, propagation, predictions, each against another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gnss_hil.flightsw.assignment.boresight_angles import (
    angles_rad,
    boresights_ecef,
    clear_of_earth,
    directions,
)
from gnss_hil.flightsw.attitude.attitude import (
    Attitude,
    Followed,
    attitude_now,
    dcm_from_quaternion,
    levers_ecef,
    turn,
)
from gnss_hil.flightsw.measurement.range_model import rays
from gnss_hil.flightsw.orbit import almanac
from gnss_hil.flightsw.orbit.propagator import propagate
from gnss_hil.flightsw.records.epoch import (
    NO_ALMANAC,
    NO_MEASUREMENTS,
    AlmanacRows,
    AttitudeReport,
    Measurements,
)
from tests.support import synthetic_epochs as s

pytestmark = pytest.mark.verifies(
    "flightsw/attitude/attitude.py",
    "flightsw/attitude/options.py",
    "flightsw/assignment/boresight_angles.py",
    what="Attitude input, boresights, angles (blocks 4 to 7)",
    by="SciPy rotations; points along the ray",
    status="validated",
)

RNG = np.random.default_rng(11)


def random_unit(n):
    v = RNG.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_dcm_against_scipy():
    """scipy's rotation is active and scalar last: the passive DCM is its transpose."""
    for q in RNG.normal(size=(20, 4)):
        q /= np.linalg.norm(q)
        assert dcm_from_quaternion(q) == pytest.approx(Rotation.from_quat([*q[1:], q[0]]).as_matrix().T)


def test_turning_on_for_a_second():
    dcm, rate = s.lvlh(s.Circle(6_800e3, 0.9, 1.0, 0.4)), np.array([0.02, -0.3, 0.1])
    assert turn(rate, 1.5) @ dcm == pytest.approx(s.turned(dcm, rate, 1.5), abs=1e-14)
    assert turn(np.zeros(3), 1.0) == pytest.approx(np.eye(3))


def test_held_attitude_follows_its_rates_then_ends():
    dcm = s.lvlh(s.Circle(6_800e3, 0.9, 1.0, 0.4))
    rate = np.array([0.01, -0.02, 0.03])
    report = AttitudeReport(s.quaternion(dcm @ s.ecef_from_eci(0).T), rate)
    now = attitude_now(report, None, s.T0_NS, hold=2)
    for second in (1, 2):
        now = attitude_now(None, now, s.T0_NS + second * 10**9, hold=2)
        expected = s.turned(dcm, rate, second) @ s.ecef_from_eci(second).T
        assert now.dcm_body_from_ecef == pytest.approx(expected, abs=1e-12)
    assert attitude_now(None, now, s.T0_NS + 3 * 10**9, hold=2) is None
    assert attitude_now(None, attitude_now(report, None, s.T0_NS, 0), s.T0_NS + 10**9, hold=0) is None


def test_lever_rates_are_the_levers_derivative():
    dcm, rate, lever = (
        s.lvlh(s.Circle(6_800e3, 0.9, 1.0, 0.4)),
        np.array([0.1, -0.2, 0.05]),
        RNG.normal(size=(4, 3)),
    )

    def at(t):
        return lever @ s.turned(dcm, rate, t) @ s.ecef_from_eci(t).T

    attitude = attitude_now(AttitudeReport(s.quaternion(dcm @ s.ecef_from_eci(0).T), rate), None, 0, 0)
    position, velocity = levers_ecef(attitude, lever)
    assert position == pytest.approx(at(0))
    assert velocity == pytest.approx((at(1e-4) - at(-1e-4)) / 2e-4, abs=1e-8)


def test_boresights_turn_with_the_body():
    dcm = Rotation.random(rng=1).as_matrix()
    axes = random_unit(4)
    attitude = Attitude(dcm, np.zeros(3), 0, 0, Followed(dcm, 0))
    assert boresights_ecef(attitude, axes) == pytest.approx(np.array([dcm.T @ axis for axis in axes]))


def test_angles_against_arccos_and_where_arccos_fails():
    los, axes = random_unit(50), random_unit(4)
    assert angles_rad(los.T, axes) == pytest.approx(np.arccos(np.clip(axes @ los.T, -1, 1)), abs=1e-7)
    axis = np.array([[0.0, 0.0, 1.0]])
    for tiny in (1e-9, 1e-5):
        near = np.array([[np.sin(tiny), 0, np.cos(tiny)], [np.sin(tiny), 0, -np.cos(tiny)]])
        assert angles_rad(near.T, axis)[0] == pytest.approx([tiny, np.pi - tiny], rel=1e-12)


def test_blockage_against_points_along_the_ray():
    """Geodetic height of many points of each ray; the ray is clear if the lowest is high enough."""
    a, f = 6378137.0, 1 / 298.257223563

    def height(points):
        p, z = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
        lat = np.arctan2(z, p * (1 - f) ** 2)
        for _ in range(4):
            n = a / np.sqrt(1 - f * (2 - f) * np.sin(lat) ** 2)
            lat = np.arctan2(z + f * (2 - f) * n * np.sin(lat), p)
        n = a / np.sqrt(1 - f * (2 - f) * np.sin(lat) ** 2)
        return p * np.cos(lat) + z * np.sin(lat) - n * (1 - f * (2 - f) * np.sin(lat) ** 2)

    limit, checked = 50e3, 0
    for craft in random_unit(8) * 6_800e3:
        sats = random_unit(40) * 26_560e3
        los, distance = directions(sats.T, craft)
        lowest = height(
            craft + los.T[:, None, :] * (distance[:, None] * np.linspace(0, 1, 4000))[..., None]
        ).min(1)
        sure = np.abs(lowest - limit) > 500
        assert np.array_equal(clear_of_earth(los, distance, craft, limit)[sure], lowest[sure] > limit)
        checked += sure.sum()
    assert checked > 300


@pytest.mark.verifies(
    "flightsw/orbit/almanac.py",
    "flightsw/orbit/propagator.py",
    what="Almanac use, propagation without fixes",
    by="independent integration in an inertial frame",
    status="validated",
)
def test_coasting_against_inertial_integration():
    """Two bodies and J2 integrated by DOP853 in the inertial frame."""
    orbit = s.Circle(6_793e3, 0.9, 1.0, 0.4)
    j2, re = 1.08262982e-3, 6378137.0

    def rate(t, y):
        r = y[:3]
        n = np.linalg.norm(r)
        z2 = 5 * r[2] ** 2 / n**2
        bulge = 1.5 * j2 * re**2 / n**2 * (np.array([1, 1, 3]) - z2)
        return [*y[3:], *(-s.MU / n**3 * r * (1 + bulge))]

    y = solve_ivp(
        rate, (0, 600), [*orbit.at(0), *orbit.velocity(0)], method="DOP853", rtol=1e-12, atol=1e-6
    ).y[:, -1]
    to_ecef = s.ecef_from_eci(600.0)
    expected = to_ecef @ y[:3], to_ecef @ (y[3:] - np.cross([0, 0, s.W], y[:3]))
    r0, v0 = orbit.at(0), orbit.velocity(0)
    start = s.ecef_from_eci(0) @ r0, s.ecef_from_eci(0) @ (v0 - np.cross([0, 0, s.W], r0))
    position, velocity = propagate(*start, 600.0)
    assert np.linalg.norm(position - expected[0]) < 0.1
    assert np.linalg.norm(velocity - expected[1]) < 1e-4
    back = propagate(position, velocity, -600.0)
    assert np.linalg.norm(back[0] - start[0]) < 0.1


def almanac_rows(sats, sky, t):
    to_ecef = s.ecef_from_eci(t)
    pos = np.array([to_ecef @ sky[sat].at(t) for sat in sats])
    vel = np.array([to_ecef @ (sky[sat].velocity(t) - np.cross([0, 0, s.W], sky[sat].at(t))) for sat in sats])
    return AlmanacRows(np.array(sats), pos.T, vel.T, np.ones(len(sats), bool))


@pytest.mark.parametrize(("age_s", "bound_m"), [(0, 1e-6), (20, 0.2), (300, 600.0)])
def test_predictions_follow_the_orbits(age_s, bound_m):
    sky = s.constellation()
    m = NO_MEASUREMENTS
    table = almanac.updated(almanac.no_predictions(), almanac_rows(list(sky), sky, 0.0), m, s.T0_NS)
    sat, position = almanac.predicted(table, s.T0_NS + age_s * 10**9)
    assert sat.tolist() == sorted(sky)
    to_ecef = s.ecef_from_eci(age_s)
    expected = np.array([to_ecef @ sky[k].at(age_s) for k in sorted(sky)])
    assert np.linalg.norm(position.T - expected, axis=1).max() < bound_m


def test_old_predictions_are_forgotten():
    sky = s.constellation()
    m, none = NO_MEASUREMENTS, NO_ALMANAC
    table = almanac.updated(almanac.no_predictions(), almanac_rows([1, 2], sky, 0.0), m, s.T0_NS)
    table = almanac.updated(table, none, m, s.T0_NS + 899 * 10**9)
    assert table.predicted.sum() == 2
    assert almanac.updated(table, none, m, s.T0_NS + 901 * 10**9).predicted.sum() == 0


def test_earths_turn_during_the_flight():
    """The ray's range is the distance in the inertial frame: 41 cm a millisecond would not go unnoticed."""
    sky = s.constellation()
    craft = s.Circle(6_793e3, 0.9, 1.0, 0.4).at(0)
    for orbit in list(sky.values())[:6]:
        tau = s.transmission(orbit, craft, 0.0)
        sent = s.ecef_from_eci(-tau) @ orbit.at(-tau)
        ray = rays(sent[:, None], (s.ecef_from_eci(0) @ craft)[:, None])
        assert ray.range_m[0] == pytest.approx(s.C * tau, abs=1e-7)


@pytest.mark.parametrize(
    ("what", "pos_scale", "vel_scale"),
    [("in the Earth", 0.2, 1.0), ("at its centre", 0.0, 1.0), ("off", 1.0, 2.5)],
)
def test_almanac_rows_that_are_no_orbit_leave_what_was_known(what, pos_scale, vel_scale):
    sky = s.constellation()
    m = NO_MEASUREMENTS
    sound = almanac_rows([1, 2, 70], sky, 0.0)
    table = almanac.updated(almanac.no_predictions(), sound, m, s.T0_NS)
    assert np.flatnonzero(table.predicted).tolist() == [1, 2, 70]
    scale = np.array([1.0, pos_scale, 1.0]), np.array([1.0, vel_scale, 1.0])
    bad = replace(sound, pos_ecef_m=sound.pos_ecef_m * scale[0], vel_ecef_mps=sound.vel_ecef_mps * scale[1])
    bad, _ = almanac.orbits(bad, m)
    again = almanac.updated(table, bad, m, s.T0_NS + 10**9)
    assert again.t_ns[[1, 2, 70]].tolist() == [s.T0_NS + 10**9, s.T0_NS, s.T0_NS + 10**9], what
    assert np.array_equal(again.pos_ecef_m[:, 2], sound.pos_ecef_m[:, 1])
    fresh = almanac.updated(almanac.no_predictions(), bad, m, s.T0_NS)
    assert np.flatnonzero(fresh.predicted).tolist() == [1, 70]


@pytest.mark.parametrize("sat", [0, 64, 2 * 64 + 5, 7 * 64 + 63])
def test_almanac_of_no_known_satellite_is_not_used(sat):
    rows = replace(almanac_rows([1], s.constellation(), 0.0), sat=np.array([sat]))
    assert not len(almanac.orbits(rows, NO_MEASUREMENTS)[0].sat)


@pytest.mark.parametrize("orbit", [(26_560e3, 55), (25_510e3, 64.8), (42_164e3, 0), (7_000e3, 98)])
def test_every_closed_orbit_is_plausible(orbit):
    radius, inclination = orbit
    sky = {1: s.Circle(radius, np.radians(inclination), 0.4, 2.0)}
    rows = almanac_rows([1], sky, 0.0)
    assert almanac.plausible(rows.sat, rows.pos_ecef_m, rows.vel_ecef_mps).all()


def tracked(sats, sky, t, health=0.0):
    """Measurements at t of satellites that are tracked, as far as the table of predictions asks for them."""
    rows = almanac_rows(sats, sky, t)
    n, flat = len(sats), np.zeros(len(sats))
    return Measurements(
        receiver=rows.sat, channel=rows.sat, sat=rows.sat, pseudorange_m=flat, range_rate_mps=flat,
        cn0_dbhz=flat, lock=flat, health=np.full(n, health), ura=flat, pos_sv_m=rows.pos_ecef_m,
        vel_sv_mps=rows.vel_ecef_mps, clock_m=flat, clock_drift_mps=flat, signal=rows.sat, frequency=flat,
    )  # fmt: skip


@pytest.mark.parametrize("health", [0.0, 1.0, 7.0])
def test_a_tracked_satellite_is_as_healthy_as_it_reports(health):
    sky = s.constellation()
    known = almanac.updated(
        almanac.no_predictions(), almanac_rows([1, 2], sky, 0.0), NO_MEASUREMENTS, s.T0_NS
    )
    table = almanac.updated(known, NO_ALMANAC, tracked([2], sky, 0.0, health), s.T0_NS)
    assert known.healthy[[1, 2]].all()
    assert table.healthy[1] and table.healthy[2] == (health == 0)


@pytest.mark.parametrize(("age_s", "stands"), [(1, True), (60, True), (119, True), (121, False)])
def test_a_report_of_a_tracked_satellite_stands_against_the_almanac_for_two_minutes(age_s, stands):
    sky = s.constellation()
    now_ns = s.T0_NS + age_s * 10**9
    table = almanac.updated(almanac.no_predictions(), NO_ALMANAC, tracked([1], sky, 0.0), s.T0_NS)
    rows = almanac_rows([1], sky, float(age_s))
    rows = replace(rows, pos_ecef_m=rows.pos_ecef_m + 250.0)
    table = almanac.updated(table, rows, NO_MEASUREMENTS, now_ns)
    _, position = almanac.predicted(table, now_ns)
    truth = s.ecef_from_eci(age_s) @ sky[1].at(age_s)
    off_m = np.linalg.norm(position[:, 0] - truth)
    assert off_m < 40 if stands else off_m == pytest.approx(250 * 3**0.5, rel=1e-3)
