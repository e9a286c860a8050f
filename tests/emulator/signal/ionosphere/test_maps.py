"""Content between the nodes and epochs of maps: skies for which the answer is known without any map."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.signal.ionosphere.maps import Maps, vertical_tecu

pytestmark = pytest.mark.verifies(what="Ionosphere: measured maps, their reader")

STEP = np.radians(5.0)
NORTH, EAST = STEP * np.arange(-17, 18), -np.pi + STEP * np.arange(72)
HOURS = 2


def maps_of(content, count=4):
    """Maps every two hours of content(t_s, latitude, longitude)."""
    values = [content(t_s, NORTH[:, None], EAST[None]) for t_s in 3600.0 * HOURS * np.arange(count)]
    return Maps(
        0, 3600.0 * HOURS, count, NORTH[0], STEP, len(NORTH), EAST[0], STEP, len(EAST),
        np.stack([np.broadcast_to(v, (35, 72)) for v in values]).ravel(),
    )  # fmt: skip


RNG = np.random.default_rng(6)
LAT, LON = RNG.uniform(-1.4, 1.4, 200), RNG.uniform(-np.pi, np.pi, 200)


@pytest.mark.parametrize("t_s", [0.0, 1800.0, 3600.0, 9000.0, 21000.0])
def test_a_bulge_that_follows_the_sun_is_followed(t_s):
    """Content by local time alone stays as it is between two maps: the Earth turns by 15 deg an hour."""

    def bulge(t_s, lat, lon):
        return 20.0 + 10.0 * np.cos(lon + 2 * np.pi * t_s / 86_400 - 0.7) + 0 * lat

    found = vertical_tecu(maps_of(bulge), 0, t_s, LAT, LON)
    assert found == pytest.approx(bulge(t_s, LAT, LON), abs=10.0 * STEP**2 / 8 + 1e-9)


def test_between_rows_and_maps_content_is_linear():
    def plane(t_s, lat, lon):
        return 20.0 + 8.0 * lat + t_s / 3600.0 + 0 * lon

    maps = maps_of(plane)
    for t_s in (0.0, 3000.0, 14_000.0):
        assert vertical_tecu(maps, 0, t_s, LAT, LON) == pytest.approx(plane(t_s, LAT, LON), abs=1e-9)


def test_beyond_the_last_row_its_content_goes_on():
    maps = maps_of(lambda t_s, lat, lon: 20.0 + 8.0 * lat + 0 * lon)
    found = vertical_tecu(maps, 0, 100.0, np.array((-1.55, 1.55)), np.array((0.3, 0.3)))
    assert found == pytest.approx(20.0 + 8.0 * NORTH[[0, -1]])
