"""Blocks 8 and 9: properties of the assignment on any geometry, and the patent's silences one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gnss_hil.dbc.common.registry import table
from gnss_hil.flightsw.assignment.nearest_boresight import NearestBoresightOptions, assign
from gnss_hil.flightsw.assignment.registry import POLICIES, policy

DEG = np.pi / 180


@st.composite
def skies(draw):
    antennas = draw(st.integers(1, 6))
    satellites = draw(st.integers(0, 40))
    # Angles on a coarse grid, so that ties are common.
    angles = draw(
        hnp.arrays(float, (antennas, satellites), elements=st.integers(0, 36).map(lambda k: 5 * k * DEG))
    )
    mask = draw(hnp.arrays(float, antennas, elements=st.sampled_from([60 * DEG, 85 * DEG, 120 * DEG])))
    channels = draw(hnp.arrays(np.int64, antennas, elements=st.integers(1, 8)))
    previous = draw(hnp.arrays(np.int64, satellites, elements=st.integers(-1, antennas - 1)))
    return angles, mask, channels, previous


@pytest.mark.slow
@given(
    skies(), st.sampled_from(["drop", "next"]), st.sampled_from(["antenna", "all"]), st.sampled_from([0, 7.0])
)
@settings(max_examples=150, deadline=None)
def test_channels_and_mask_hold(sky, overflow, reading, hysteresis):
    angles, mask, channels, _ = sky
    options = NearestBoresightOptions(overflow=overflow, mask_reading=reading, hysteresis_deg=hysteresis)
    chosen = assign(*sky, options)
    # One satellite, one antenna, by the shape of the answer.
    assert len(chosen) == angles.shape[1]
    sats = np.flatnonzero(chosen >= 0)
    assert (angles[chosen[sats], sats] < mask[chosen[sats]]).all()
    if reading == "all":
        assert (angles[:, sats] < mask[:, None]).all()
    assert (np.bincount(chosen[sats], minlength=len(mask)) <= channels).all()


@given(skies())
@settings(max_examples=150, deadline=None)
def test_literal_patent_by_exhaustive_reading(sky):
    """Steps 8 and 9 in loops: nearest antenna, lower one in a tie; nearest satellites stay."""
    angles, mask, channels, _ = sky
    expected = [-1] * angles.shape[1]
    for a in range(len(mask)):
        wanting = [
            (angles[a][i], i)
            for i in range(angles.shape[1])
            if a == min(range(len(mask)), key=lambda k: (angles[k][i], k)) and angles[a][i] < mask[a]
        ]
        for _, i in sorted(wanting)[: channels[a]]:
            expected[i] = a
    assert assign(*sky, NearestBoresightOptions()).tolist() == expected


@pytest.mark.slow
@given(skies())
@settings(max_examples=150, deadline=None)
def test_next_leaves_no_satellite_and_antenna_that_would_rather_have_each_other(sky):
    angles, mask, channels, _ = sky
    chosen = assign(*sky, NearestBoresightOptions(overflow="next"))
    for i in range(angles.shape[1]):
        for a in range(len(mask)):
            if angles[a, i] >= mask[a] or (chosen[i] >= 0 and angles[a, i] >= angles[chosen[i], i]):
                continue
            held = np.flatnonzero(chosen == a)
            assert len(held) == channels[a]
            assert (angles[a, held] <= angles[a, i]).all()


@pytest.mark.slow
@given(skies())
@settings(max_examples=100, deadline=None)
def test_next_tracks_at_least_as_many_as_drop(sky):
    drop, following = (assign(*sky, NearestBoresightOptions(overflow=o)) for o in ("drop", "next"))
    assert (following >= 0).sum() >= (drop >= 0).sum()


def one(angles_deg, previous=-1, mask_deg=85.0, **options):
    angles = np.radians(np.array(angles_deg, float))[:, None]
    antennas = len(angles_deg)
    return assign(
        angles, np.full(antennas, mask_deg * DEG), np.full(antennas, 6),
        np.array([previous]), NearestBoresightOptions(**options),
    )[0]  # fmt: skip


def test_tie_goes_to_the_lower_antenna():
    assert one([40, 30, 30]) == 1


def test_hysteresis_keeps_the_present_antenna_until_the_difference_exceeds_it():
    assert one([40, 38], previous=0) == 1
    assert one([40, 38], previous=0, hysteresis_deg=3) == 0
    assert one([40, 36], previous=0, hysteresis_deg=3) == 1
    assert one([85.5, 84], previous=0, hysteresis_deg=3) == 1, "hysteresis does not reach beyond the mask"


def test_hysteresis_keeps_a_satellite_against_a_slightly_nearer_one():
    angles = np.radians([[50.0, 49.0]])
    args = angles, np.array([85 * DEG]), np.array([1]), np.array([0, -1])
    assert assign(*args, NearestBoresightOptions()).tolist() == [-1, 0]
    assert assign(*args, NearestBoresightOptions(hysteresis_deg=2)).tolist() == [0, -1]


def test_mask_readings():
    assert one([30, 100]) == 0, "the description: the mask of the antenna that tracks"
    assert one([30, 100], mask_reading="all") == -1, "claim 1: all antennas' masks"
    assert one([85, 86]) == -1, "at the mask is not below it"


def test_registry():
    assert list(POLICIES) == ["patent", "prototype", "analogue", "single"]
    with pytest.raises(
        ValueError, match="policy 'best': not known; there are patent, prototype, analogue, single"
    ):
        policy("best")
    with pytest.raises(ValueError, match=r"two rows are named 'patent'"):
        table(POLICIES["patent"], POLICIES["patent"])
    for row in POLICIES.values():
        assert row.source and row.summary
        assert all(f.description for f in row.options.model_fields.values())
