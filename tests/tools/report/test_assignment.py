"""Antennas that stayed empty are named, with the reason where their axes tell."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gnss_hil.tools.report.assignment import _empty, _taken_up
from gnss_hil.tools.report.tracking_arcs import Holds

pytestmark = pytest.mark.verifies(
    "tools/report/assignment.py",
    what="Report: antennas without a satellite",
    by="craft made by hand",
    status="modelled",
)

UP, FORE = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)


def craft(axes, used, commanded=True):
    vehicle = SimpleNamespace(names=("a", "b", "c")[: len(axes)], boresight_body=np.array(axes))
    return SimpleNamespace(
        vehicle=vehicle, holds=SimpleNamespace(receiver=np.array(used)), handed_out=commanded
    )


@pytest.mark.parametrize(
    ("axes", "used", "commanded", "said"),
    [
        ((UP, FORE), [1, 2, 1], True, []),
        ((UP, UP), [1], True, ["Antenna b measured nothing: it looks where a does, and at a tie the lower "
                               "antenna is given the satellite."]),
        ((UP, UP), [1], False, ["Antenna b measured nothing."]),
        ((UP, FORE), [1], True, ["Antenna b measured nothing."]),
        ((UP, UP), [2], True, ["Antenna a measured nothing."]),
    ],
)  # fmt: skip
def test_an_empty_antenna_is_named(axes, used, commanded, said):
    assert _empty(craft(axes, used, commanded)) == said


@pytest.mark.parametrize(
    ("begin_s", "end_s", "at_s"),
    [(103, 200, [103]), (50, 200, [100]), (50, 90, []), (300, 400, []), (103, 104, [103])],
)
def test_a_handover_is_marked_where_the_bar_of_the_new_antenna_begins(begin_s, end_s, at_s):
    """Commanded at 100 s; a satellite that no measurement follows has no mark that floats in the air."""
    one = [np.array([v]) for v in (2, 7, begin_s * 10**9, end_s * 10**9)]
    handed = [(100 * 10**9, 7, 1, 2), (100 * 10**9, 8, 1, 2)]
    marks = _taken_up(SimpleNamespace(holds=Holds(*one), handed=handed))
    assert [(t // 10**9, s) for t, s, *_ in marks] == [(t, 7) for t in at_s]
