"""The craft's orbit against the closed two-body solution, secular theory and an independent integrator."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.messages import KIND_BY_NAME
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.earth.constants import MU_M3PS2, ROTATION_RPS, eci_to_ecef, rotation_angle_rad
from gnss_hil.emulator.orbits import forces
from gnss_hil.emulator.orbits.dynamics import Orbit, build_orbit, semi_major_axis_m, state_of_elements

START_NS = gpstime.from_calendar(datetime(2012, 10, 31, 0, 15))
LEAP_S = 16
ISS = {
    "altitude_km": 415,
    "inclination_deg": 51.6,
    "raan_deg": 40,
    "arg_perigee_deg": 30,
    "eccentricity": 0.002,
}
MOLNIYA = {"semi_major_axis_km": 26600, "eccentricity": 0.72, "inclination_deg": 63.4, "arg_perigee_deg": 270}
GEO = {"semi_major_axis_km": 42164, "inclination_deg": 0.05}


def elements(**more):
    return scenario.Orbit(**more)


def inertial(orbit, t_s):
    """Position and velocity, eci, at t_s after the start, from what the orbit gives in ecef."""
    t_ns = START_NS + round(t_s * 1e9)
    state = orbit.at(t_ns)
    back = -rotation_angle_rad(t_ns, LEAP_S)
    velocity = state.vel_ecef_mps + np.cross((0, 0, ROTATION_RPS), state.pos_ecef_m)
    return eci_to_ecef(state.pos_ecef_m, back), eci_to_ecef(velocity, back)


def kepler_eci(orbit, t_s):
    """Two-body motion from its elements by Kepler's equation, solved by bisection (independent code)."""
    a, e = semi_major_axis_m(orbit), orbit.eccentricity
    nu0 = np.deg2rad(orbit.true_anomaly_deg)
    e0 = 2 * np.arctan2(np.sqrt(1 - e) * np.sin(nu0 / 2), np.sqrt(1 + e) * np.cos(nu0 / 2))
    mean = e0 - e * np.sin(e0) + np.sqrt(MU_M3PS2 / a**3) * t_s
    low, high = mean - 1, mean + 1
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if middle - e * np.sin(middle) < mean else (low, middle)
    nu = 2 * np.arctan2(np.sqrt(1 + e) * np.sin(low / 2), np.sqrt(1 - e) * np.cos(low / 2))
    return state_of_elements(orbit.model_copy(update={"true_anomaly_deg": np.degrees(nu)}))


@pytest.mark.parametrize("orbit", [ISS, MOLNIYA, GEO], ids=["low", "molniya", "geo"])
@pytest.mark.parametrize("t_s", [0, 1234.5, 20000, -3000])
def test_without_forces_the_motion_is_keplers(orbit, t_s):
    orbit = elements(**orbit, forces=[])
    pos, vel = inertial(build_orbit(orbit, START_NS), t_s)
    expected_pos, expected_vel = kepler_eci(orbit, t_s)
    assert pos == pytest.approx(expected_pos, abs=2e-5)
    assert vel == pytest.approx(expected_vel, abs=1e-6)


@pytest.mark.verifies(what="Craft orbit: integration")
@pytest.mark.parametrize("orbit", [ISS, MOLNIYA], ids=["low", "molniya"])
def test_the_full_field_agrees_with_dop853(orbit):
    """scipy's DOP853 at 1e-13 on a potential differentiated numerically by itself."""
    orbit = elements(**orbit)
    pos, vel = state_of_elements(orbit)

    def rate(_, state):
        return np.concatenate((state[3:], gravity(state[:3])))

    span_s = 6 * 3600
    solution = solve_ivp(
        rate, (0, span_s), np.concatenate((pos, vel)), method="DOP853", rtol=1e-13, atol=1e-7, max_step=120
    )
    expected = solution.y[:, -1]
    pos, vel = inertial(build_orbit(orbit, START_NS), span_s)
    assert pos == pytest.approx(expected[:3], abs=1e-3)
    assert vel == pytest.approx(expected[3:], abs=1e-6)


def gravity(r):
    """Acceleration by J2, J3, J4 in the expanded Cartesian form (Vallado, Fundamentals, 8.6), one vector."""
    x, y, z = r
    d = np.linalg.norm(r)
    mu, re = MU_M3PS2, 6_378_136.3
    j2, j3, j4 = 1.0826261738522e-3, -2.5324105185677e-6, -1.6198975999169e-6
    s = z / d
    a2 = (
        -1.5 * j2 * mu * re**2 / d**5 * np.array((x * (1 - 5 * s**2), y * (1 - 5 * s**2), z * (3 - 5 * s**2)))
    )
    a3 = -2.5 * j3 * mu * re**3 / d**7 * np.array(
        (x * (3 * z - 7 * z * s**2), y * (3 * z - 7 * z * s**2), 6 * z**2 - 7 * z**2 * s**2 - 0.6 * d**2)
    )  # fmt: skip
    plane = 1 - 14 * s**2 + 21 * s**4
    a4 = (
        15
        / 8
        * j4
        * mu
        * re**4
        / d**7
        * np.array((x * plane, y * plane, z * (5 - 70 / 3 * s**2 + 21 * s**4)))
    )
    return -mu * r / d**3 + a2 + a3 + a4


def test_zonal_accelerations_are_the_expanded_ones():
    rng = np.random.default_rng(5)
    pos = rng.normal(size=(50, 3))
    pos *= (rng.uniform(6.6e6, 4e7, 50) / np.linalg.norm(pos, axis=1))[:, None]
    total = forces.zonals(["j2", "j3", "j4"])(np.zeros(50, np.int64), pos, np.zeros_like(pos))
    assert total == pytest.approx(np.array([gravity(r) for r in pos]), rel=1e-12, abs=1e-14)


def test_secular_rates_of_node_and_perigee_under_j2():
    """Vallado, Fundamentals of Astrodynamics, 9.6.1: first order in J2, so good to some 0.3 %."""
    orbit = elements(
        altitude_km=600, eccentricity=0.02, inclination_deg=51.6, arg_perigee_deg=20, forces=["j2"]
    )
    a, e, i = semi_major_axis_m(orbit), orbit.eccentricity, np.deg2rad(orbit.inclination_deg)
    n = np.sqrt(MU_M3PS2 / a**3)
    factor = 1.5 * n * forces.ZONAL[2] * (forces.REFERENCE_RADIUS_M / (a * (1 - e * e))) ** 2
    path = build_orbit(orbit, START_NS)
    period_s = 2 * np.pi / n
    # Averages over whole revolutions, some fifteen of them apart, leave short-period terms out.
    phases = np.arange(24) / 24 * period_s
    nodes, perigees = (
        np.array([np.mean([osculating(path, k * period_s + p)[which] for p in phases]) for k in (0, 14)])
        for which in (0, 1)
    )
    span_s = 14 * period_s
    assert (nodes[1] - nodes[0]) / span_s == pytest.approx(-factor * np.cos(i), rel=5e-3)
    assert (perigees[1] - perigees[0]) / span_s == pytest.approx(
        factor * (2 - 2.5 * np.sin(i) ** 2), rel=3e-2
    )


def osculating(path, t_s):
    """Right ascension of the node and argument of perigee [rad] at t_s."""
    pos, vel = inertial(path, t_s)
    h = np.cross(pos, vel)
    node = np.array((-h[1], h[0], 0.0)) / np.hypot(h[0], h[1])
    ecc = np.cross(vel, h) / MU_M3PS2 - pos / np.linalg.norm(pos)
    across = np.cross(h / np.linalg.norm(h), node)
    return np.arctan2(node[1], node[0]), np.arctan2(ecc @ across, ecc @ node)


@pytest.mark.slow
def test_energy_and_polar_momentum_are_kept_over_a_day():
    """Zonal gravity has a potential that does not know longitude: both are constants of motion."""
    path = build_orbit(elements(**ISS), START_NS)

    def constants(t_s):
        pos, vel = inertial(path, t_s)
        d, s = np.linalg.norm(pos), pos[2] / np.linalg.norm(pos)
        legendre = np.polynomial.legendre.Legendre
        potential = 1 - sum(
            j * (forces.REFERENCE_RADIUS_M / d) ** n * legendre.basis(n)(s) for n, j in forces.ZONAL.items()
        )
        return vel @ vel / 2 - MU_M3PS2 / d * potential, np.cross(pos, vel)[2]

    first = constants(0)
    for t_s in (5000, 43210, 86400):
        energy, momentum = constants(t_s)
        assert energy == pytest.approx(first[0], rel=2e-12)
        assert momentum == pytest.approx(first[1], rel=2e-12)


def test_velocity_and_acceleration_are_derivatives_of_the_position():
    path = build_orbit(elements(**ISS), START_NS)
    for t_s in (0.0, 59.9, 777.7):
        at = START_NS + round(t_s * 1e9)
        before, now, after = (path.at(at + k * 200_000_000) for k in (-1, 0, 1))
        assert (after.pos_ecef_m - before.pos_ecef_m) / 0.4 == pytest.approx(now.vel_ecef_mps, abs=1e-4)
        assert (after.vel_ecef_mps - before.vel_ecef_mps) / 0.4 == pytest.approx(now.acc_ecef_mps2, abs=1e-6)


def test_the_start_has_the_scenarios_elements_and_segments_join():
    orbit = elements(**ISS)
    path = build_orbit(orbit, START_NS)
    pos, vel = inertial(path, 0)
    expected = state_of_elements(orbit)
    assert pos == pytest.approx(expected[0], abs=1e-6)
    assert vel == pytest.approx(expected[1], abs=1e-7)
    for edge_s in (60, 1800, 3600, 0, -1800):
        edge_ns = START_NS + edge_s * 10**9
        before, after = path.at(edge_ns - 1), path.at(edge_ns)
        assert after.pos_ecef_m - before.pos_ecef_m == pytest.approx(1e-9 * after.vel_ecef_mps, abs=1e-6)
        assert after.vel_ecef_mps == pytest.approx(before.vel_ecef_mps, abs=1e-7)


def test_any_order_of_questions_gives_the_same_orbit():
    times = [START_NS + k * 10**9 for k in (-4000, -10, 0, 1000, 5000, 9000)]
    one, other = (build_orbit(elements(**ISS), START_NS) for _ in range(2))
    forward = [one.at(t).pos_ecef_m.tobytes() for t in times]
    assert forward == [other.at(t).pos_ecef_m.tobytes() for t in reversed(times)][::-1]


def test_an_orbit_that_meets_the_earth_is_refused_in_one_line():
    with pytest.raises(scenario.ScenarioError, match=r"perigee at -\d+ km; allowed is 100 km and above$"):
        build_orbit(elements(altitude_km=400, eccentricity=0.3, inclination_deg=50), START_NS)


def test_the_highest_orbit_stays_where_the_bus_has_coordinates():
    """The worst for its margin: elements given 105 km above the pole, where they lack most of J2's energy."""
    nav = KIND_BY_NAME["NAV_X"].signals[-1]
    reach_m = nav.raw_range[1] * nav.factor
    perigee_m, apogee_m = 6_378_137.0 + 105e3, 6_378_137.0 + 100_999.9e3
    axis_m = (perigee_m + apogee_m) / 2
    polar = {"inclination_deg": 90, "arg_perigee_deg": 90, "eccentricity": 1 - perigee_m / axis_m}
    orbit = build_orbit(elements(semi_major_axis_km=axis_m / 1e3, **polar), START_NS)
    half_s = np.pi * np.sqrt(axis_m**3 / MU_M3PS2)
    times_s = half_s * np.linspace(0.97, 1.08, 12)
    radius_m = [np.linalg.norm(orbit.at(START_NS + round(t * 1e9)).pos_ecef_m) for t in times_s]
    assert 1 < np.argmax(radius_m) < 10
    assert 1.01 * apogee_m < max(radius_m) < reach_m


@pytest.mark.parametrize(
    "forces, message",
    [
        (["egm2008", "j2"], "forces: j2 contained in egm2008"),
        (["sun", "moon", "sun"], "forces: sun named twice"),
    ],
)
def test_forces_that_would_act_twice_are_refused(forces, message):
    with pytest.raises(ValueError, match=message):
        elements(**ISS, forces=forces)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("orbit", "hours"), [(ISS, 3), (MOLNIYA, 6), (GEO, 6)], ids=["low", "molniya", "geo"]
)
def test_all_forces_at_once_run_both_ways_in_time(orbit, hours):
    """Where a run ends, another that starts there and goes back arrives at the first one's start. Dark to
    light and back, the air of a perigee, degree 20."""
    given = elements(**orbit, forces=["egm2008", "sun", "moon", "drag", "radiation"])
    span_s = hours * 3600
    there = build_orbit(given, START_NS)
    end = inertial(there, span_s)
    back = Orbit(START_NS + span_s * 10**9, *end, there.acceleration)
    returned = inertial(back, 0)
    begun = state_of_elements(given)
    assert returned[0] == pytest.approx(begun[0], abs=0.05)
    assert returned[1] == pytest.approx(begun[1], abs=1e-4)
