"""What a craft sees: angles, and the Earth in the way against the geodetic height along the ray."""

import erfa
import numpy as np
import pytest

from gnss_hil.emulator.signal import geometry, visibility

pytestmark = pytest.mark.verifies(
    "emulator/signal/visibility.py",
    "emulator/signal/epoch_geometry.py",
    what="Visibility and ray height",
    by="search along the ray with ERFA's geodetic coordinates",
    status="validated",
)


def test_angles_are_exact_near_zero_and_pi():
    tiny = 1e-9
    boresight = np.array([[1.0, 0.0, 0.0]])
    los = np.array([[np.cos(a), np.sin(a), 0.0] for a in (0.0, tiny, 1.0, np.pi / 2, np.pi - tiny)])
    found = visibility.angles_rad(boresight, los)[0]
    assert found == pytest.approx([0.0, tiny, 1.0, np.pi / 2, np.pi - tiny], rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("latitude_deg", [0.0, 30.0, 51.6])
def test_ray_height_is_the_least_geodetic_height(latitude_deg):
    """Rays that graze the Earth in all directions, against a search with ERFA's geodetic coordinates."""
    craft = erfa.gd2gc(1, 0.4, np.deg2rad(latitude_deg), 415e3)
    up = craft / np.linalg.norm(craft)
    side = np.cross(up, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    for turn in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        level = np.cos(turn) * side + np.sin(turn) * np.cross(up, side)
        for below_deg in (17.0, 18.5, 19.5):
            los = np.cos(np.deg2rad(below_deg)) * level - np.sin(np.deg2rad(below_deg)) * up
            along = np.linspace(0, 5e6, 20001)
            _, _, heights = erfa.gc2gd(1, craft + along[:, None] * los)
            found = visibility.ray_height_m(craft, 2.5e7 * los[None])[0]
            assert found == pytest.approx(heights.min(), abs=400)


def test_earth_blocks_only_between_craft_and_satellite():
    craft = np.array([4.2e7, 0.0, 0.0])
    through = visibility.ray_height_m(craft, np.array([[-6.8e7, 1e6, 0.0]]))
    before = visibility.ray_height_m(craft, np.array([[-1.5e7, 1e6, 0.0]]))
    upward = visibility.ray_height_m(craft, np.array([[1e7, 1e6, 0.0]]))
    assert through[0] < 0
    assert before[0] == upward[0] == np.inf


def test_elevation_and_distance():
    craft = np.array([7e6, 0.0, 0.0])
    positions = np.array([[2.7e7, 0.0, 0.0], [7e6, 2e7, 0.0]])
    still = geometry.Motion(positions, np.zeros((2, 3)), np.zeros((2, 3)))
    seen = visibility.look(still, craft, np.array([[1.0, 0.0, 0.0]]))
    assert seen.distance_m == pytest.approx([2e7, 2e7])
    assert seen.sin_elevation == pytest.approx([1.0, 0.0], abs=1e-12)
    assert seen.angle_rad[0] == pytest.approx([0.0, np.pi / 2], abs=1e-12)
