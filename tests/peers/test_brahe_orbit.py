"""Drag and sunlight through day and night against SciPy's DOP853 with brahe's air, shadow and forces."""

from __future__ import annotations

from datetime import datetime

import erfa
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.earth.constants import eci_to_ecef, rotation_angle_rad
from gnss_hil.emulator.orbits.dynamics import build_orbit, state_of_elements
from tests.support.outside import peer

pytestmark = [
    pytest.mark.verifies(what="Air density and drag"),
    pytest.mark.verifies(what="Sunlight and shadow"),
]

brahe = peer("brahe")

START_NS = round((datetime(2012, 10, 31) - datetime(1980, 1, 6)).total_seconds() + 16) * 10**9
DAY_S = 86400.0
MU, J2, RADIUS_M = 3.986004418e14, 1.0826261738522e-3, 6_378_136.3
MASS_KG, AREA_M2 = 1000.0, 20.0


def sun_of_day():
    """Polynomials of time [s] for the Sun's place [m] in the intermediate frame of the start."""
    to_eci = erfa.c2i06a(2_456_231.5, 67.184 / DAY_S)
    t_s = np.linspace(-600, DAY_S + 600, 60)
    sun = -149_597_870_700.0 * erfa.epv00(2_456_231.5, (67.184 + t_s) / DAY_S)[0]["p"] @ to_eci.T
    return [np.polynomial.Chebyshev.fit(t_s, axis, 12) for axis in sun.T]


def judged(orbit, force, step_s, times_s):
    """Inertial positions (n, 3) [m] under J2 and `force(t_s, state, sun)`."""
    sun = sun_of_day()

    def rate(t_s, state):
        pos = state[:3]
        r2 = pos @ pos
        oblate = -1.5 * J2 * MU * RADIUS_M**2 / r2**2.5
        polar = 5 * pos[2] ** 2 / r2
        acc = -MU / r2**1.5 * pos + oblate * np.array((1 - polar, 1 - polar, 3 - polar)) * pos
        return np.concatenate((state[3:], acc + force(state, np.array([axis(t_s) for axis in sun]))))

    start = np.concatenate(state_of_elements(orbit))
    solution = solve_ivp(
        rate, (0, times_s[-1]), start, "DOP853", times_s, rtol=1e-12, atol=1e-6, max_step=step_s
    )
    return solution.y[:3].T


def miss_m(orbit, force, step_s, span_s):
    """Largest distance [m] between the two."""
    times_s = np.linspace(0, span_s, 25)
    path = build_orbit(orbit, START_NS)
    t_ns = START_NS + np.rint(times_s * 1e9).astype(np.int64)
    ours = np.array([path.at(int(t)).pos_ecef_m for t in t_ns])
    expected = eci_to_ecef(judged(orbit, force, step_s, times_s), rotation_angle_rad(t_ns, 16))
    distance = np.linalg.norm(ours - expected, axis=1).max()
    print(f"{orbit.forces}: {distance:.2e} m")
    return distance


def sunlight(state, sun):
    lit = brahe.eclipse_conical(state[:3], sun)
    return lit * brahe.accel_solar_radiation_pressure(state[:3], sun, MASS_KG, 1.3, AREA_M2, 4.56e-6)


def drag(state, sun):
    air = brahe.density_harris_priester(state[:3], sun)
    return brahe.accel_drag(state, air, MASS_KG, AREA_M2, 2.2, np.eye(3))


def orbit(**more):
    return scenario.Orbit(**more, mass_kg=MASS_KG, radiation_area_m2=AREA_M2, drag_area_m2=AREA_M2)


def test_a_low_day_through_fifteen_nights():
    """Each passage into the shadow takes 8 s, the nodes of a segment lie up to 8 s apart."""
    low = orbit(altitude_km=400, inclination_deg=51.6, raan_deg=40, forces=["j2", "radiation"])
    assert miss_m(low, sunlight, 6.0, DAY_S) < 0.1


def test_a_high_day_through_its_night():
    """A circular orbit of a day, with a nodal line that carries it through the middle of the shadow."""
    high = orbit(
        semi_major_axis_km=42164, inclination_deg=13, raan_deg=290, true_anomaly_deg=75,
        forces=["j2", "radiation"],
    )  # fmt: skip
    assert miss_m(high, sunlight, 30.0, DAY_S) < 0.01


def test_six_hours_in_the_air():
    """Brahe's own ellipsoid, bulge (its exponent 3 is 6 here) and drag, which moves a craft at 300 km by
    kilometres in six hours."""
    low = orbit(altitude_km=300, inclination_deg=51.6, bulge_exponent=6, forces=["j2", "drag"])
    assert miss_m(low, drag, 20.0, DAY_S / 4) < 0.01
