"""Roll, pitch and yaw of craft whose attitude is known without a computer."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.numerics.rotations import dcm_321, quaternion_of_dcm
from gnss_hil.tools.report.attitude_plot import angle_between_arcsec, attitude, roll_pitch_yaw_deg
from tests.support.plots import array, craft, named

pytestmark = pytest.mark.verifies(
    "tools/report/attitude_plot.py",
    what="Report: attitude",
    by="turns of the emulator's own sequence; angles known without a computer",
    status="validated",
)

AXES = np.array([[[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]])
"""Over ECEF x, flying along y: the orbit's x is y, its y is -z, its z is -x."""
ORBIT = np.array([[0, 1.0, 0], [0, 0, -1.0], [-1.0, 0, 0]])


@pytest.mark.parametrize("turns", [(0, 0, 0), (90, 0, 0), (0, 40, 0), (0, 0, -170), (-120, 30, 75)])
def test_turns_come_out_as_they_went_in(turns):
    dcm = dcm_321(*np.radians(turns)) @ ORBIT
    assert roll_pitch_yaw_deg(dcm[None], AXES)[0] == pytest.approx(turns, abs=1e-9)


def test_angles_between_attitudes_are_right_when_tiny_and_blind_to_signs():
    one = np.array([[1.0, 0, 0, 0]] * 3)
    half = np.radians(np.array([1e-7, 45, 45]) / 2)
    other = np.column_stack([np.cos(half), np.sin(half), 0 * half, 0 * half]) * np.array([[1], [1], [-1]])
    assert angle_between_arcsec(one, other) == pytest.approx(3600 * np.array([1e-7, 45, 45]), rel=1e-6)


def drawn(n=200, truth=True, bus=True):
    rolls = np.radians(np.linspace(0, 400, n))
    slew = np.array([quaternion_of_dcm(dcm_321(roll, 0.1, 0.2) @ ORBIT) for roll in rolls])
    nothing = np.full((n, 4), np.nan)
    return attitude(craft(n, quaternion=slew if bus else nothing, truth_quaternion=slew if truth else None,
                          axes=np.repeat(AXES, n, axis=0)))  # fmt: skip


def test_a_slew_is_seen_and_has_a_gap_where_it_comes_round():
    plot = drawn()
    lines = [array(trace["y"]) for trace in named(plot.figure, "bus")]
    assert np.nanmax(lines[0]) - np.nanmin(lines[0]) > 340 and np.isnan(lines[0]).sum() == 1
    assert lines[1] == pytest.approx(np.degrees(0.1), abs=1e-3)
    for values in lines:
        steps = np.diff(values)
        assert np.nanmax(np.abs(steps)) < 20
    assert "arcsec at most" in plot.note


def test_without_truth_there_is_no_error_and_without_a_bus_nothing():
    assert len(named(drawn(truth=False).figure, "bus")) == 3
    assert named(drawn(truth=False).figure, "bus - truth") == []
    assert drawn(bus=False).figure is None


def test_an_attitude_only_where_there_is_no_orbit_is_no_picture():
    angle = np.full((10, 4), np.nan)
    angle[:5] = (1.0, 0, 0, 0)
    axes = np.repeat(AXES, 10, axis=0)
    axes[:5] = np.nan
    plot = attitude(craft(10, quaternion=angle, truth_quaternion=None, axes=axes))
    assert plot.figure is None and "both" in plot.note
