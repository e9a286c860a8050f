"""Names beside points do not cover each other, however close the points stand."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.tools.report.antenna_skies import LABEL_PX, RADIUS_PX, names_at_px, standing_px
from gnss_hil.tools.report.labels import Ink, beside

pytestmark = pytest.mark.verifies(
    "tools/report/labels.py",
    what="Report: names in skies",
    by="boxes counted pair by pair",
    status="validated",
)

NONE = np.zeros((0, 2))


def overlaps(centres, size=LABEL_PX) -> int:
    apart = np.abs(centres[:, None] - centres[None]) < np.array(size)
    return int(np.triu(apart.all(axis=-1), 1).sum())


def sky(seed: int, satellites: int):
    """Ends and ways of satellites all over a sky, as of a craft that moves one way."""
    random = np.random.default_rng(seed)
    turn, off = random.uniform(0, 2 * np.pi, satellites), RADIUS_PX * np.sqrt(random.random(satellites))
    ends = np.column_stack([off * np.sin(turn), off * np.cos(turn)])
    ways = ends[:, None] + np.linspace(0, 1, 30)[None, :, None] * np.array([3.0, 50.0])
    return ends, ways.reshape(-1, 2)


@pytest.mark.parametrize("seed", range(12))
def test_names_of_a_full_sky_do_not_overlap_and_stay_inside(seed):
    ends, ways = sky(seed, 30)
    names = names_at_px(ends, ways[np.linalg.norm(ways, axis=1) < RADIUS_PX], 90.0)
    assert overlaps(names) == 0
    assert overlaps(np.concatenate((names, standing_px(90.0)))) == 0, "over a ring's or a side's"
    assert np.linalg.norm(names, axis=1).max() <= RADIUS_PX
    assert np.linalg.norm(names - ends, axis=1).max() < 80


def test_satellites_at_one_place_are_named_apart():
    names = beside(np.zeros((6, 2)), LABEL_PX, NONE, Ink.of(NONE, 100), 100.0)
    assert overlaps(names) == 0


def test_a_name_stands_clear_of_what_is_drawn_and_of_what_is_kept_clear():
    point = np.zeros((1, 2))
    line = np.column_stack([np.linspace(-60, 60, 200), np.full(200, 10.0)])
    (above,) = beside(point, LABEL_PX, NONE, Ink.of(NONE, 100), 100.0)
    (below,) = beside(point, LABEL_PX, NONE, Ink.of(line, 100), 100.0)
    assert above[1] > 0 > below[1]
    (aside,) = beside(point, LABEL_PX, above[None], Ink.of(NONE, 100), 100.0)
    assert np.abs(aside - above).max() > 5


def test_ink_counts_cells_of_a_box():
    ink = Ink.of(np.array([[1.0, 1], [1.5, 1.5], [30, 1]]), 40)
    assert ink.within(np.array([[0.0, 0], [30, 0], [0, -30]]), np.array([16.0, 16])).tolist() == [1, 1, 0]
