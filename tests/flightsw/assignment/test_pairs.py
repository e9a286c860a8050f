"""Pairs of channels: the policy's choice with two channels for each satellite that has both signals."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.flightsw.assignment.nearest_boresight import NearestBoresightOptions, assign
from gnss_hil.flightsw.assignment.pairs import in_pairs

pytestmark = pytest.mark.verifies(
    "flightsw/assignment/pairs.py",
    what="Satellites on pairs of channels",
    by="small skies assigned by hand; random ones: an antenna's channels are never overdrawn",
    status="modelled",
)

L2 = 4
MASK = np.full(2, 1.5)


def pairs(angles, channels, second=None, single=(), previous=None, mask=MASK, **options):
    angles = np.array(angles, float)
    m, n = angles.shape
    second = np.full((m, n), L2) if second is None else np.array(second)
    alone = np.zeros(n, bool)
    alone[list(single)] = True
    before = np.full(n, -1) if previous is None else np.array(previous)
    found = in_pairs(
        assign, angles, mask, np.array(channels), before, NearestBoresightOptions(**options), second, alone
    )
    return [column.tolist() for column in found]


def test_a_satellite_takes_two_channels_of_its_nearest_antenna():
    """Four channels are room for two satellites; the third one is dropped though another antenna is idle."""
    antenna, second = pairs([[0.3, 0.1, 0.2], [0.9, 0.9, 0.9]], [4, 4])
    assert antenna == [-1, 0, 0] and second == [0, L2, L2]
    antenna, second = pairs([[0.3, 0.1, 0.2], [0.9, 0.9, 0.9]], [4, 4], overflow="next")
    assert antenna == [1, 0, 0] and second == [L2, L2, L2]


def test_a_satellite_without_the_second_signal_has_what_channels_are_left():
    """Pairs go first, however near the other satellite is."""
    antenna, second = pairs([[0.1, 0.2, 0.3]], [4], single=[0], mask=MASK[:1])
    assert antenna == [-1, 0, 0] and second == [0, L2, L2]
    antenna, second = pairs([[0.1, 0.2, 0.3]], [5], single=[0], mask=MASK[:1])
    assert antenna == [0, 0, 0] and second == [0, L2, L2]


def test_an_odd_channel_takes_one_signal_of_the_next_satellite():
    antenna, second = pairs([[0.1, 0.2]], [3], mask=MASK[:1])
    assert antenna == [0, 0] and second == [L2, 0]


def test_an_antenna_without_second_signals_tracks_its_satellites_by_one():
    second_of = [[L2, L2, L2], [0, 0, 0]]
    antenna, second = pairs([[0.1, 0.9, 0.9], [0.9, 0.1, 0.2]], [2, 2], second_of)
    assert antenna == [0, 1, 1] and second == [L2, 0, 0]


def test_without_any_pair_it_is_the_policys_own_choice():
    rng = np.random.default_rng(3)
    angles = rng.uniform(0, np.pi, (2, 20))
    antenna, second = pairs(angles, [3, 5], np.zeros((2, 20), int))
    options = NearestBoresightOptions()
    assert antenna == assign(angles, MASK, np.array([3, 5]), np.full(20, -1), options).tolist()
    assert not any(second)
    assert pairs(np.zeros((2, 0)), [3, 5]) == [[], []]


@pytest.mark.parametrize("seed", range(20))
def test_channels_are_never_overdrawn(seed):
    rng = np.random.default_rng(seed)
    m, n = 4, 30
    channels, angles = rng.integers(0, 13, m), rng.uniform(0, np.pi, (m, n))
    second = L2 * rng.integers(0, 2, (m, n)) * rng.integers(0, 2, (m, 1))
    antenna, extra = (
        np.array(column)
        for column in pairs(
            angles, channels, second, np.flatnonzero(rng.integers(0, 2, n)), mask=np.full(m, 1.5),
            overflow=("drop", "next")[seed % 2],
        )
    )  # fmt: skip
    taken = np.bincount(antenna[antenna >= 0], minlength=m) + np.bincount(antenna[extra > 0], minlength=m)
    assert (taken <= channels).all()
    assert (antenna[extra > 0] >= 0).all()
    assert (second[antenna[extra > 0], np.flatnonzero(extra)] == extra[extra > 0]).all()
