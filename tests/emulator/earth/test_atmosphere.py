"""Density of the air against published tables and brahe; drag's acceleration and decay in closed form."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.earth import atmosphere, sun_moon
from gnss_hil.emulator.earth.constants import MU_M3PS2
from gnss_hil.emulator.orbits import forces
from gnss_hil.emulator.orbits.dynamics import OrbitError, build_orbit, state_of_elements
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "emulator/earth/atmosphere.py",
    "emulator/orbits/forces.py",
    what="Air density and drag",
    by=(
        "Harris-Priester table and US Standard Atmosphere 1976 at 300 to 500 km; brahe's density; "
        "King-Hele's decay of a circular orbit, 0.3 %; DOP853 with brahe's drag, 0.4 mm in six hours"
    ),
    status="validated",
)

START_NS = gpstime.from_utc(datetime(2012, 10, 31))
EQUATOR_M = 6_378_137.0
SUN_M = 1.5e11 * np.array((0.0, 1.0, 0.0))
APEX = np.array((-np.sin(np.pi / 6), np.cos(np.pi / 6), 0.0))
"""30 deg of right ascension after that Sun."""
SPIN_RPS = 7.2921151467e-5


def density(direction, height_m, exponent=4.0):
    pos_m = (EQUATOR_M + height_m) * np.asarray(direction, float)[None]
    return atmosphere.density_kgpm3(pos_m, SUN_M[None], exponent)[0]


@pytest.mark.parametrize(
    "height_km, least, most", [(200, 255.7, 316.2), (400, 2.249, 7.492), (800, 7.069e-3, 8.059e-2)]
)
def test_apex_and_antapex_are_the_tables(height_km, least, most):
    """Montenbruck & Gill, Satellite Orbits, table 3.8 [g/km^3]."""
    assert density(APEX, 1e3 * height_km) == pytest.approx(1e-12 * most, rel=1e-9, abs=0)
    assert density(-APEX, 1e3 * height_km) == pytest.approx(1e-12 * least, rel=1e-9, abs=0)


@pytest.mark.parametrize("height_km, standard", [(300, 1.916e-11), (400, 2.803e-12), (500, 5.215e-13)])
def test_the_standard_atmosphere_lies_between(height_km, standard):
    """U.S. Standard Atmosphere, 1976, table of density [kg/m^3]: mean solar activity, no bulge."""
    assert density(-APEX, 1e3 * height_km) < standard < density(APEX, 1e3 * height_km)


def test_half_way_around_the_bulge():
    """cos^n(psi/2) at 90 deg is 2^(-n/2): a quarter for n = 4, an eighth for n = 6."""
    aside = np.array((0.0, 0.0, 1.0))
    polar_m = 6_356_752.314245 + 400e3
    for exponent, part in ((2, 1 / 2), (4, 1 / 4), (6, 1 / 8)):
        found = atmosphere.density_kgpm3(polar_m * aside[None], SUN_M[None], exponent)[0]
        assert found == pytest.approx(1e-12 * (2.249 + part * (7.492 - 2.249)), rel=1e-6, abs=0)


def test_density_is_brahes():
    """Its exponent, 3, is that of cos^2(psi/2), as in Montenbruck & Gill's code (not the text): 6 here."""
    brahe = peer("brahe")
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(200, 3))
    pos_m = (
        directions
        * ((EQUATOR_M + rng.uniform(130e3, 970e3, 200)) / np.linalg.norm(directions, axis=1))[:, None]
    )
    sun_m = np.broadcast_to(1.48e11 * np.array((-0.5, -0.78, -0.34)), pos_m.shape)
    expected = [brahe.density_harris_priester(p, s) for p, s in zip(pos_m, sun_m, strict=True)]
    assert atmosphere.density_kgpm3(pos_m, sun_m, 6.0) == pytest.approx(np.array(expected), rel=2e-4, abs=0)


def test_above_the_table_is_nothing_below_it_nan():
    assert density(APEX, 1001e3) == 0.0
    assert np.isnan(density(APEX, 99e3))


def test_altitude_is_that_of_geodetic_coordinates():
    """Forward through the definition of geodetic coordinates (NIMA TR8350.2), which needs no iteration."""
    latitude, longitude = np.deg2rad(np.linspace(-90, 90, 61)), np.deg2rad(np.linspace(0, 360, 61))
    e2 = 0.00669437999014
    curvature_m = EQUATOR_M / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    for height_m in (100e3, 400e3, 1000e3):
        across = (curvature_m + height_m) * np.cos(latitude)
        z = ((1 - e2) * curvature_m + height_m) * np.sin(latitude)
        pos = np.stack((across * np.cos(longitude), across * np.sin(longitude), z), 1)
        assert atmosphere.altitude_m(pos) == pytest.approx(height_m, abs=1e-3)


def orbit(**more):
    return scenario.Orbit(altitude_km=400, inclination_deg=0.0, mass_kg=800, drag_area_m2=12, **more)


def test_drag_is_half_rho_v_squared():
    """At the antapex of 31 October 2012, 400 km over the equator: 2.249 g/km^3 (the table), eastward circular
    motion through air that turns with the Earth."""
    sun, _ = sun_moon.InertialBodies(START_NS).at(np.array([START_NS]))
    angle = np.arctan2(sun[0, 1], sun[0, 0]) + np.pi / 6 + np.pi
    pos = (EQUATOR_M + 400e3) * np.array((np.cos(angle), np.sin(angle), 0.0))
    vel = np.sqrt(MU_M3PS2 / (EQUATOR_M + 400e3)) * np.array((-np.sin(angle), np.cos(angle), 0.0))
    given = orbit(forces=["drag"], bulge_exponent=6.0)
    at = np.array([START_NS])
    both = forces.total(given, START_NS)(at, pos[None], vel[None])
    found = (both - forces.central(at, pos[None], vel[None]))[0]
    speed = np.linalg.norm(vel) - SPIN_RPS * (EQUATOR_M + 400e3)
    expected = -0.5 * 2.249e-12 * 2.2 * 12 / 800 * speed * speed * vel / np.linalg.norm(vel)
    # The Sun stands 14 deg south: the bulge reaches a little over to the equator's far side.
    assert found == pytest.approx(expected, rel=2e-3, abs=1e-15)


def test_decay_of_a_circular_orbit_in_a_revolution():
    """King-Hele, Satellite Orbits in an Atmosphere, 4.3: the axis loses 2 pi (Cd A / m) rho a^2 F, with
    F = (1 - r w / v)^2 eastward over the equator; rho is brahe's mean around the circle."""
    brahe = peer("brahe")
    given = orbit(forces=["drag"], bulge_exponent=6.0)
    axis_m = EQUATOR_M + 400e3
    sun, _ = sun_moon.InertialBodies(START_NS).at(np.array([START_NS]))
    around = np.arange(720) * np.pi / 360
    circle_m = axis_m * np.stack((np.cos(around), np.sin(around), np.zeros(720)), 1)
    mean_kgpm3 = np.mean([brahe.density_harris_priester(place, sun[0]) for place in circle_m])
    turning = (1 - SPIN_RPS * axis_m / np.sqrt(MU_M3PS2 / axis_m)) ** 2
    expected_m = 2 * np.pi * (2.2 * 12 / 800) * mean_kgpm3 * axis_m**2 * turning

    path = build_orbit(given, START_NS)
    period_s = 2 * np.pi * np.sqrt(axis_m**3 / MU_M3PS2)
    lost_m = axis_m - np.array([axis(path, START_NS + round(k * period_s * 1e9)) for k in (0, 1, 2, 3)])
    assert lost_m[0] == pytest.approx(0.0, abs=1e-5)
    # Each revolution is lower by it, and its air denser by a hundredth of a percent.
    assert np.diff(lost_m) == pytest.approx(expected_m, rel=3e-3)


def axis(path, t_ns):
    """Semi-major axis [m] by the energy of the inertial motion."""
    state = path.at(t_ns)
    vel = state.vel_ecef_mps + np.cross((0, 0, SPIN_RPS), state.pos_ecef_m)
    return 1 / (2 / np.linalg.norm(state.pos_ecef_m) - vel @ vel / MU_M3PS2)


def test_a_craft_that_comes_down_is_told_so():
    falling = scenario.Orbit(
        altitude_km=160, inclination_deg=30, forces=["j2", "drag"], mass_kg=10, drag_area_m2=50
    )
    path = build_orbit(falling, START_NS)
    with pytest.raises(OrbitError, match="the orbit meets the Earth, or air too dense to fly in"):
        for hour in range(24):
            path.at(START_NS + hour * 3_600_000_000_000)
    assert np.linalg.norm(state_of_elements(falling)[0]) > EQUATOR_M
