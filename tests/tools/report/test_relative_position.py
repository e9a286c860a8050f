"""One craft from another: vectors known without a computer."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.report.relative_position import relative_position
from tests.support.plots import array, craft, named

pytestmark = pytest.mark.verifies(
    "tools/report/relative_position.py",
    what="Report: relative position",
    by="vectors known without a computer",
    status="validated",
)

AXES = np.array([[[0, 1.0, 0], [0, 0, 1.0], [1.0, 0, 0]]] * 10)
HERE = np.tile([7e6, 1.0, 2.0], (10, 1))


def pair(truth=True, away=(3.0, 10.0, 500.0), wrong=(0.3, 0, 0.4)):
    own = {"axes": AXES, "position_m": HERE + 5, "truth_m": HERE if truth else None}
    there = HERE + np.array(away)
    other = {"axes": AXES, "position_m": there + 5 + np.array(wrong), "truth_m": there if truth else None}
    return craft(10, name="a", **own), craft(10, name="b", **other)


def test_the_difference_is_in_the_first_ones_axes_and_common_errors_cancel():
    plot = relative_position(*pair())
    assert plot.title == "b from a"
    lines = [array(trace["y"])[0] for trace in named(plot.figure, "by the fixes")]
    assert lines == pytest.approx([10, 500.4, 3.3], abs=1e-4)
    (error,) = named(plot.figure, "error")
    assert array(error["y"]) == pytest.approx(np.full(10, 0.5), abs=1e-4)
    assert "0.500 m median" in plot.note


def test_without_truth_there_is_no_error():
    plot = relative_position(*pair(truth=False))
    assert named(plot.figure, "error") == [] and "truth" not in plot.note


def test_two_that_never_have_a_fix_together():
    first, second = pair()
    second.position_m = HERE * np.nan
    assert relative_position(first, second).figure is None


def test_without_velocities_there_are_no_axes():
    first, second = pair(truth=False)
    first.axes = AXES * np.nan
    plot = relative_position(first, second)
    assert plot.figure is None and "No fix of a has a velocity" in plot.note
