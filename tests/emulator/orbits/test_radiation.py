"""Sunlight: textbook pressure, shadow against rays counted one by one and against brahe."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.config import scenario
from gnss_hil.emulator.earth import sun_moon
from gnss_hil.emulator.orbits import forces, radiation
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "emulator/orbits/radiation.py",
    what="Sunlight and shadow",
    by=(
        "4.56e-6 N/m^2 at 1 au; rays counted against a sphere; brahe's shadow; DOP853 through fifteen "
        "nights, 3 cm in a day"
    ),
    status="validated",
)

AU_M = 149_597_870_700.0
EARTH_M = 6_378_137.0
SUN_M = np.array((AU_M, 0.0, 0.0))


def fraction(*places_m):
    places = np.array(places_m, float)
    return radiation.sunlit_fraction(places, np.broadcast_to(SUN_M, places.shape))


def counted(pos_m, n=400):
    """Part of the Sun's disk whose rays miss the Earth: n x n rays in space, each against the sphere."""
    axis = (SUN_M - pos_m) / np.linalg.norm(SUN_M - pos_m)
    aside = np.cross(axis, (0.0, 0.0, 1.0))
    aside /= np.linalg.norm(aside)
    up = np.cross(aside, axis)
    grid = (np.arange(n) + 0.5) / n * 2 - 1
    u, v = (w.ravel() for w in np.meshgrid(grid, grid))
    inside = u * u + v * v < 1
    # The limb lies where lines from the craft touch the Sun.
    tangent = 696e6 / np.sqrt(np.sum((SUN_M - pos_m) ** 2) - 696e6**2)
    rays = axis + tangent * (u[inside, None] * aside + v[inside, None] * up)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    along = rays @ -pos_m
    hit = (along > 0) & (pos_m @ pos_m - along**2 < EARTH_M**2)
    return 1 - hit.mean()


def test_pressure_at_one_astronomical_unit():
    """4.56e-6 N/m^2, absorbed (Montenbruck & Gill, Satellite Orbits, 3.4)."""
    pos_m = np.array(((0.0, 0.0, 7e6),))
    pressure = radiation.pressure_npm2(pos_m, SUN_M[None])[0]
    assert np.linalg.norm(pressure) == pytest.approx(4.56e-6, rel=1e-6)
    assert pressure[0] == pytest.approx(-4.56e-6, rel=1e-6)


def test_pressure_falls_with_the_square_of_the_distance():
    """Perihelion and aphelion, 0.98329 and 1.01671 au: +3.4 and -3.3 percent."""
    at = [
        np.linalg.norm(radiation.pressure_npm2(np.array(((0, 7e6, 0.0),)), d * SUN_M[None]))
        for d in (0.98329, 1.01671)
    ]
    assert np.array(at) / 4.56e-6 == pytest.approx([1.0343, 0.9674], abs=2e-4)


def test_the_force_is_that_of_a_ball():
    start_ns = gpstime.from_utc(datetime(2012, 6, 21))
    given = scenario.Orbit(
        altitude_km=500, inclination_deg=90, forces=["radiation"], mass_kg=500, radiation_area_m2=8,
        radiation_coefficient=1.5,
    )  # fmt: skip
    at, pos = np.array([start_ns]), np.array(((0.0, 0.0, 7e6),))
    found = forces.total(given, start_ns)(at, pos, pos) - forces.central(at, pos, pos)
    sun = sun_moon.InertialBodies(start_ns).at(at)[0]
    # 1.0163 au on 21 June (aphelion, 1.0167 au, two weeks later).
    assert np.linalg.norm(found) == pytest.approx(1.5 * 8 / 500 * 4.56e-6 / 1.0163**2, rel=3e-4)
    assert found[0] @ (pos - sun)[0] == pytest.approx(np.linalg.norm(found) * np.linalg.norm(pos - sun))


@pytest.mark.parametrize("r_m", [6.8e6, 42.164e6, 106e6])
def test_penumbra_is_counted(r_m):
    """Across the edge of the shadow at several distances."""
    edge = np.arcsin(EARTH_M / r_m)
    for part in (-0.9, -0.5, -0.1, 0.3, 0.8):
        angle = np.pi - edge - part * 696e6 / AU_M
        pos_m = r_m * np.array((np.cos(angle), np.sin(angle), 0.0))
        assert fraction(pos_m)[0] == pytest.approx(counted(pos_m), abs=3e-3)
        assert 0 < fraction(pos_m)[0] < 1


def test_light_and_night():
    lit, dark = (7e6, 0, 0), (-7e6, 0, 0)
    assert fraction(lit, dark, (0, 7e6, 0), (-42e6, 6e6, 0), (-42e6, 7e6, 0)).tolist() == [1, 0, 1, 0, 1]


def test_beyond_the_umbra_a_ring_is_left():
    """By similar triangles the umbra ends at R d / (Rs - R); from there on the Earth covers less."""
    length_m = EARTH_M * AU_M / (696e6 - EARTH_M)
    far = (-2 * length_m, 0.0, 0.0)
    assert fraction(far)[0] == pytest.approx(counted(np.array(far), 600), abs=3e-3)
    assert fraction((-0.99 * length_m, 0.0, 0.0))[0] == 0.0


def test_shadow_is_brahes():
    """Its Sun has a radius of 695.7e6 m, ours 696e6 m: a thousandth of the penumbra."""
    brahe = peer("brahe")
    edge = np.arcsin(EARTH_M / 6.8e6)
    angles = np.pi - edge + np.linspace(-0.006, 0.006, 41)
    places = 6.8e6 * np.stack((np.cos(angles), np.zeros(41), np.sin(angles)), 1)
    expected = [brahe.eclipse_conical(place, SUN_M) for place in places]
    assert fraction(*places) == pytest.approx(np.array(expected), abs=2e-3)
