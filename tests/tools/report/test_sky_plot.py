"""The antennas' skies against directions known without a computer."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.tools.report.antenna_skies import LABEL_PX, RADIUS_PX, skies
from gnss_hil.tools.report.sky_plot import (
    Places,
    Sightings,
    angles_deg,
    antenna_axes,
    instants,
    look,
    side_names,
)
from tests.support.plots import array

ZENITH = np.array([0.0, 0, -1])
TILTED = np.array([np.sin(np.radians(35)), 0, -np.cos(np.radians(35))])
RADIUS_M = 2.66e7


@pytest.mark.verifies(
    "tools/report/sky_plot.py",
    "tools/report/antenna_skies.py",
    what="Report: skies of the antennas",
    by="directions and names of sides known without a computer",
    status="validated",
)
@pytest.mark.parametrize(
    ("direction", "off", "around"),
    [
        ((0, 0, -1), 0, 0),
        ((1, 0, -1), 45, 0),
        ((0, 1, -1), 45, 90),
        ((-1, 0, -1), 45, 180),
        ((0, -1, 0), 90, 270),
    ],
)
def test_a_zenith_antenna_is_a_map_with_fore_up_and_starboard_right(direction, off, around):
    los = np.array([direction], float) / np.linalg.norm(direction)
    found = angles_deg(ZENITH, los)
    assert found[0] == pytest.approx([off], abs=1e-9)
    assert off == 0 or found[1] == pytest.approx([around], abs=1e-9)


@pytest.mark.parametrize(
    ("boresight", "sides"),
    [
        (ZENITH, ("fore", "starboard", "aft", "port")),
        (-ZENITH, ("fore", "port", "aft", "starboard")),
        (TILTED, ("fore", "starboard", "aft", "port")),
        (np.array([1.0, 0, 0]), ("zenith", "port", "nadir", "starboard")),
        (np.array([0, 1.0, 0]), ("fore", "nadir", "aft", "zenith")),
    ],
)
def test_sides_have_the_names_of_the_body(boresight, sides):
    assert side_names(boresight) == sides
    axes = antenna_axes(boresight)
    assert np.allclose(axes @ axes.T, np.eye(3))


def at(*rows) -> Places:
    """(t, satellite, x, y, z) as places at rest."""
    table = np.array(rows, float).reshape(-1, 5)
    return Places(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2:], 0 * table[:, 2:])


def test_who_tracks_what_and_what_none_tracks():
    """A craft on the x axis whose zenith is x: one measured, one predicted, one behind the Earth."""
    craft = np.array([[7e6, 0, 0]])
    half = np.sqrt(0.5)
    upright = np.array([[half, 0, -half, 0]])  # body z, nadir, is ECEF -x
    measured = at((0, 7, RADIUS_M, 0, 0), (0, 7, RADIUS_M, 0, 0))
    predicted = at((5, 7, RADIUS_M, 1, 0), (5, 9, RADIUS_M, 0.5 * RADIUS_M, 0), (5, 11, -RADIUS_M, 0, 0))
    seen = look(
        np.array([0]),
        craft,
        upright,
        np.stack([ZENITH, -ZENITH, TILTED]),
        measured,
        np.array([1, 3]),
        predicted,
    )
    assert seen.satellite.tolist() == [7, 9]
    assert seen.tracked.tolist() == [[True, False, True], [False, False, False]]
    assert seen.off_deg[0] == pytest.approx([0, 180, 35], abs=1e-6)
    elevation = np.degrees(np.arctan2(0.5 * RADIUS_M, RADIUS_M - 7e6))
    assert seen.off_deg[1, :2] == pytest.approx([elevation, 180 - elevation], abs=1e-6)


def test_a_prediction_is_carried_on_with_its_velocity_and_not_for_ever():
    craft, upright = np.array([[7e6, 0, 0]] * 2), np.array([[1.0, 0, 0, 0]] * 2)
    predicted = Places(np.array([0]), np.array([9]), np.array([[RADIUS_M, 0, 0]]), np.array([[0, 3000.0, 0]]))
    none = at()
    times = np.array([60, 121]) * 1_000_000_000
    seen = look(times, craft, upright, np.array([[1.0, 0, 0]]), none, np.zeros(0, int), predicted)
    assert seen.instant.tolist() == [0]
    assert seen.off_deg[0, 0] == pytest.approx(np.degrees(np.arctan2(180e3, RADIUS_M - 7e6)))


def test_instants_are_spread_over_what_can_be_used():
    usable = np.ones(1000, bool)
    usable[:500] = False
    rows = instants(usable, 5)
    assert rows.tolist() == [500, 625, 750, 874, 999]
    assert len(instants(np.zeros(10, bool))) == 0


def drawn(off, around, tracked, satellite=None, step_s=6):
    """The sky of one zenith antenna: off, around (k, n) of n satellites at k instants, tracked (k, n)."""
    off, around, tracked = (np.asarray(v) for v in (off, around, tracked))
    k, n = off.shape
    instant = np.repeat(np.arange(k), n)
    seen = Sightings(
        instant * step_s * 10**9, instant, np.tile(np.arange(n) + 1 if satellite is None else satellite, k),
        tracked.reshape(-1, 1), off.reshape(-1, 1).astype(float), around.reshape(-1, 1).astype(float),
    )  # fmt: skip
    vehicle = SimpleNamespace(
        antennas=1, names=("a",), mask_rad=np.radians([85.0]), boresight_body=ZENITH[None]
    )
    (plot,) = skies(SimpleNamespace(sightings=seen, vehicle=vehicle))
    return plot.figure["data"]


def test_satellites_are_lines_with_an_arrow_the_way_they_went():
    """One goes up over the sky, one to the right and then none tracks it."""
    off, around = np.array([[60.0, 10], [50, 20], [40, 30]]), np.array([[180, 90], [180, 90], [180, 90]])
    none, other, own, _, rings, heads, *names = drawn(
        off, around, [[True, True], [True, True], [True, False]]
    )
    assert array(own["r"]).tolist()[:3] == [60, 50, 40] and np.isnan(array(own["r"])[3])
    assert array(own["r"]).tolist()[4:] == [10, 20, 30]  # on to where another kind begins
    assert array(none["r"]).tolist() == [30] and len(array(other["r"])) == 0
    assert own["mode"].startswith("lines") and own["line"]["color"] == "--antenna-1"
    assert (rings["text"], rings["r"]) == (["30\u00b0", "60\u00b0", "90\u00b0"], [30, 60, 90])
    assert heads["marker"]["angle"] == pytest.approx([0, 90])
    assert heads["marker"]["symbol"] == ["arrow", "arrow"]
    assert sorted(name for trace in names for name in trace["text"]) == ["G01", "G02"]


def test_places_of_a_long_run_are_not_joined():
    off, around = np.array([[80.0], [10], [70]]), np.array([[0], [90], [180]])
    _, _, own, *_ = drawn(off, around, [[True]] * 3, step_s=600)
    assert np.isnan(array(own["r"])).tolist() == [False, True, False, True, False]


def test_every_satellite_is_named_and_no_name_covers_another():
    random = np.random.default_rng(3)
    n = 31
    around = random.uniform(0, 360, n)
    end = 88 * np.sqrt(random.random(n))
    off = np.stack([np.minimum(end + 12 - i, 89) for i in range(13)])
    *_, inside, outside = drawn(off, np.tile(around, (13, 1)), np.tile(random.random(n) < 0.4, (13, 1)))
    assert sorted(inside["text"] + outside["text"]) == [f"G{i:02d}" for i in range(1, n + 1)]
    r, theta = (np.r_[array(inside[k]), array(outside[k])] for k in ("r", "theta"))
    x, y = (f(np.radians(theta)) * r * RADIUS_PX / 90 for f in (np.sin, np.cos))
    apart = (np.abs(x[:, None] - x) < LABEL_PX[0] - 0.01) & (np.abs(y[:, None] - y) < LABEL_PX[1] - 0.01)
    assert np.triu(apart, 1).sum() == 0
    assert r.max() <= 90  # plotly leaves out what is further
