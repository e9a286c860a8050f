"""Residuals by satellite: ranges with clocks, levers, a turning Earth, and one satellite that is wrong."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.flightsw.orbit.earth import LIGHT_MPS, ROTATION_RPS
from gnss_hil.tools.report.residuals import Ranges, Residuals, picture, residuals
from tests.support.plots import T0_NS

pytestmark = pytest.mark.verifies(
    "tools/report/residuals.py",
    what="Report: residuals by satellite",
    by="ranges by iterated light time, clocks and one wrong satellite put in by hand",
    status="validated",
)

MARKS = 6
SATELLITES = np.array([1, 2, 3, 4, 5, 65, 66, 67, 68])
LEVER = np.array([[1.5, 0, -2], [0, 2.5, 0]])
VEHICLE = SimpleNamespace(lever_arm_body_m=LEVER, clock_domain=np.array([0, 1]))
HERE = np.array([6.8e6, 1e5, -2e5])
BUS = np.tile([0.5, 0.5, 0.5, 0.5], (MARKS, 1))
"""Body x is ECEF y, y is z, z is x."""


def ranges(wrong_m: float = 0.0, used=True):
    random = np.random.default_rng(3)
    n = len(SATELLITES)
    mark, satellite = np.repeat(np.arange(MARKS), 2 * n), np.tile(np.r_[SATELLITES, SATELLITES], MARKS)
    receiver = np.tile(np.repeat([1, 2], n), MARKS)
    away = random.normal(size=(len(mark), 3))
    place = 2.6e7 * away / np.linalg.norm(away, axis=1)[:, None]
    turned = np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])  # ECEF from body
    antenna = HERE + (LEVER @ turned.T)[receiver - 1]
    distance = np.linalg.norm(place - antenna, axis=1)
    for _ in range(4):  # light time, the Earth turning meanwhile
        angle = ROTATION_RPS * distance / LIGHT_MPS
        cos, sin = np.cos(angle), np.sin(angle)
        x, y, z = place.T
        then = np.column_stack([cos * x + sin * y, cos * y - sin * x, z])
        distance = np.linalg.norm(then - antenna, axis=1)
    clock = np.array([1e5, -3e5])[receiver - 1] + 20.0 * satellites.system_of(satellite) + 7.0 * mark
    off = np.where((satellite == 3) & (receiver == 1), wrong_m, 0)
    return Ranges(mark, receiver, satellite, np.full(len(mark), used), distance + clock + off, place)


def found(given, position=None):
    return residuals(given, np.tile(HERE, (MARKS, 1)) if position is None else position, BUS, VEHICLE)


def test_clocks_levers_and_the_turning_earth_leave_centimetres():
    """What stays is the Shapiro delay less its median."""
    assert np.abs(found(ranges()).value_m).max() < 0.05


def test_a_wrong_satellite_stands_out_and_the_others_do_not():
    given = ranges(wrong_m=40)
    left = found(given).value_m
    bad = (given.satellite == 3) & (given.receiver == 1)
    assert left[bad] == pytest.approx(40, abs=0.1) and np.abs(left[~bad]).max() < 0.1


def test_what_cannot_be_predicted_is_nan():
    position = np.tile(HERE, (MARKS, 1))
    position[2] = np.nan
    given = ranges()
    left = found(given, position).value_m
    assert (np.isnan(left) == (given.mark == 2)).all()
    assert np.isnan(found(ranges(used=False)).value_m).all()  # no clock without a range in the fix
    few = given[(given.satellite < 3) | (given.satellite > 64)]
    assert (np.isnan(found(few).value_m) == (few.satellite < 3)).all()
    assert len(found(given[:0]).value_m) == 0


def test_the_picture_has_a_row_for_each_satellite_and_names_the_worst():
    t_ns = T0_NS + np.arange(MARKS) * 10**9
    plot = picture(t_ns, found(ranges(wrong_m=40)), MARKS, [])
    (heat,) = plot.figure["data"]
    assert plot.figure["layout"]["yaxis"]["ticktext"][-1] == "G01"
    assert heat["z"]["shape"] == f"{len(SATELLITES)}, {MARKS}"
    assert "furthest off on the mean G03 +19.99" in plot.note
    assert "evenly spread" not in plot.note
    assert "Of 3 epochs" in picture(t_ns, found(ranges()), 3, []).note


def test_a_run_without_residuals_has_no_picture():
    none = np.zeros(0, np.int64)
    assert picture(np.arange(3), Residuals(none, none, none.astype(bool), np.zeros(0)), 3, []).figure is None
