"""A receiver's height by its own ranges: made of known places, without this module's formulas."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.assemble.recorded import _refuse_ground
from gnss_hil.emulator.config.scenario import ScenarioError
from gnss_hil.emulator.receivers.recorded import ground
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/receivers/recorded/ground.py",
    what="Whether a receiver was in space",
    by="ranges from known places on the ellipsoid and above it",
    status="validated",
)

LIGHT_MPS, EARTH_RPS = 299_792_458.0, 7.2921151467e-5
SCENE = emulated.world().sky.at(1_035_676_816 * 10**9)


def place(latitude_deg, height_m):
    """On longitude 30 deg, WGS-84. Source: NIMA TR8350.2, 4.15"""
    latitude, longitude = np.radians((latitude_deg, 30.0))
    e2 = 6.69437999014e-3
    normal_m = 6_378_137.0 / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    across_m = (normal_m + height_m) * np.cos(latitude)
    up_m = (normal_m * (1 - e2) + height_m) * np.sin(latitude)
    return np.array((across_m * np.cos(longitude), across_m * np.sin(longitude), up_m))


def seen(where_m, clock_m=3e5, count=99, system=satellites.GPS):
    """Ranges of the satellites above the horizon, with a clock a millisecond off, 20 m of noise."""
    rows = np.flatnonzero(satellites.system_of(SCENE.index) == system)
    up = where_m / np.linalg.norm(where_m)
    rows = rows[(SCENE.pos_ecef_m[rows] - where_m) @ up > 0][:count]
    sent_m, range_m = SCENE.pos_ecef_m[rows], []
    for pos in sent_m:
        flight_s = 0.0
        for _ in range(5):
            angle = EARTH_RPS * flight_s
            turn = np.array(
                ((np.cos(angle), np.sin(angle), 0), (-np.sin(angle), np.cos(angle), 0), (0, 0, 1))
            )
            distance_m = np.linalg.norm(turn @ pos - where_m)
            flight_s = distance_m / LIGHT_MPS
        range_m.append(distance_m + clock_m)
    noise_m = np.random.default_rng(2).normal(0, 20, len(rows))
    return SimpleNamespace(
        sat=SCENE.index[rows], pos_ecef_m=sent_m, clock_m=np.full(len(rows), -77.0),
        pseudorange_m=np.array(range_m) + 77.0 + noise_m,
    )  # fmt: skip


@pytest.mark.parametrize("latitude_deg", [-88.0, -45.0, 0.0, 30.0, 60.0])
@pytest.mark.parametrize("height_m", [0.0, 4e3, 12e3, 450e3, 1200e3])
def test_the_height_to_a_kilometre(latitude_deg, height_m):
    assert ground.height_m(seen(place(latitude_deg, height_m))) == pytest.approx(height_m, abs=1e3)


def test_without_enough_ranges_or_with_contradictions_no_height_is_made_up():
    where = place(45.0, 0.0)
    assert np.isnan(ground.height_m(seen(where, count=4)))
    torn = seen(where)
    torn.pseudorange_m[::2] += 3e5
    assert np.isnan(ground.height_m(torn))
    assert np.isnan(ground.median_height_m([]))


def craft(monkeypatch, *heights_m):
    """A played craft whose epochs are at these heights."""
    from gnss_hil.emulator.assemble import recorded

    epochs = [seen(place(40.0, height_m)) for height_m in heights_m]
    monkeypatch.setattr(recorded, "observed", lambda craft, sky, row_of, epoch: epochs[epoch])
    bounds = np.arange(len(epochs) + 1) * 9
    sky = SimpleNamespace(at=lambda t_ns: None)
    return SimpleNamespace(bounds=bounds, sky=sky, marks_ns=np.arange(len(epochs)), row_of=None)


def test_a_receiver_on_the_ground_or_in_the_air_is_refused(monkeypatch):
    for height_m in (0.0, 12e3):
        words = r"^x\.obs: the receiver is -?[\d.]+ km above the ellipsoid .*no model of the troposphere"
        with pytest.raises(ScenarioError, match=words):
            _refuse_ground(craft(monkeypatch, height_m, height_m, height_m), "x.obs")


def test_one_in_space_is_not_and_neither_is_one_without_a_fix(monkeypatch):
    _refuse_ground(craft(monkeypatch, 450e3, 450e3, 0.0), "x.obs")
    _refuse_ground(craft(monkeypatch), "x.obs")
