"""Two craft 1 km apart see almost the same ionosphere, without steps."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.earth.constants import ROTATION_RPS
from gnss_hil.emulator.signal.ionosphere.delay import delay_m
from gnss_hil.emulator.signal.ionosphere.field import of_coefficients
from gnss_hil.emulator.signal.ionosphere.presets import PRESETS
from gnss_hil.emulator.signal.ionosphere.slant import slant_tec_tecu
from tests.support.ionosphere_sky import craft_m, satellites_m, seen

L1_HZ = 1575.42e6
T_NS = 1_300_000_000_000_000_000


def field_of(activity):
    return of_coefficients(PRESETS[activity].coefficients, PRESETS[activity].profile)


@pytest.mark.parametrize(("activity", "least_m", "most_m"), [("low", 1.0, 10.0), ("high", 3.0, 40.0)])
def test_metres_at_low_activity_more_at_high(activity, least_m, most_m):
    """Mikhailov & Larkov (2011), error study: metres at low solar activity, tens of metres at high. Median
    over the rays of an orbit, and of those that pass below the horizon."""
    field = field_of(activity)
    above, below = [], []
    for t_s in np.arange(0, 5600, 60.0):
        pos, sv = craft_m(t_s), satellites_m(t_s)
        sv = sv[seen(pos, sv)]
        delay = delay_m(slant_tec_tecu(field, T_NS + round(t_s * 1e9), pos, sv), L1_HZ)
        up = (sv - pos) @ pos > 0
        above.append(delay[up])
        below.append(delay[~up])
    assert least_m < np.median(np.concatenate(above)) < most_m
    assert np.median(np.concatenate(below)) > 2 * np.median(np.concatenate(above))


@pytest.mark.parametrize("activity", ["low", "high"])
def test_cancels_by_twenty_and_more(activity):
    """Issue's bar: 20. At 1 km it is over 1,000; above 5 deg the gradient stays below 0.03 m / km."""
    field = field_of(activity)
    own, apart, gradient = [], [], []
    for t_s in np.arange(0, 30_000, 60.0):
        pos, sv = craft_m(t_s), satellites_m(t_s)
        sv = sv[seen(pos, sv)]
        t_ns = T_NS + round(t_s * 1e9)
        first = delay_m(slant_tec_tecu(field, t_ns, pos, sv), L1_HZ)
        second = delay_m(slant_tec_tecu(field, t_ns, craft_m(t_s, 1000.0), sv), L1_HZ)
        los = (sv - pos) / np.linalg.norm(sv - pos, axis=1)[:, None]
        high = los @ pos / np.linalg.norm(pos) > np.sin(np.deg2rad(5))
        own.append(first)
        apart.append(first - second)
        gradient.append((first - second)[high])
    own, apart, gradient = map(np.concatenate, (own, apart, gradient))
    assert np.sqrt(np.mean(own**2) / np.mean(apart**2)) > 500
    assert np.abs(gradient).max() < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("activity", ["low", "high"])
def test_no_step_as_the_craft_moves(activity):
    """Every 50 m over 75 km, in several places: a step would leave a second difference as large as itself."""
    field = field_of(activity)
    for start_s in range(0, 5600, 800):
        t_s = start_s + np.arange(0, 10, 50 / 7500)
        sv = satellites_m(start_s)
        pos = np.array([craft_m(t) for t in t_s])
        sv = sv[seen(pos[0], sv)]
        every = np.repeat(pos, len(sv), axis=0), np.tile(sv, (len(pos), 1))
        content = slant_tec_tecu(field, T_NS, *every).reshape(len(pos), len(sv))
        assert np.abs(np.diff(delay_m(content, L1_HZ), 2, axis=0)).max() < 1e-3


def test_orbits_of_this_test_turn_as_they_should():
    """5,570 s for the station, half a sidereal day for GPS (Kepler's third law)."""
    turn = ROTATION_RPS * 43_082.0
    cos, sin = np.cos(turn), np.sin(turn)
    back = satellites_m(43_082.0) @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    assert np.abs(back - satellites_m(0.0)).max() < 100e3
