"""Axes of satellites and published phase centres."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.constellation import phase_centre
from gnss_hil.emulator.constellation.block_types import gps_blocks

pytestmark = pytest.mark.verifies(
    "emulator/constellation/antenna_offsets.py",
    what="Phase centres of IIF beyond the first two, of GLONASS-K, and of L1 alone",
    by="block mean; as M (0.4 m off); as of L1 with L2",
    status="modelled",
)

SUN_M = np.array((1.2e11, -0.7e11, 0.5e11))
PLACES_M = 26_560e3 * np.array(((1.0, 0, 0), (0.6, 0, 0.8), (-0.48, 0.6, -0.64)))


def test_axes_are_those_of_yaw_steering():
    """z to the Earth; the panels' axis y square to the Sun; the Sun on the side of +x."""
    axes = phase_centre.axes_ecef(PLACES_M, SUN_M)
    for place, dcm in zip(PLACES_M, axes, strict=True):
        assert dcm @ dcm.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(dcm) == pytest.approx(1)
        assert dcm[2] == pytest.approx(-place / np.linalg.norm(place))
        to_sun = (SUN_M - place) / np.linalg.norm(SUN_M - place)
        assert dcm[1] @ to_sun == pytest.approx(0, abs=1e-12)
        assert dcm[0] @ to_sun > 0


def test_a_phase_centre_lies_where_its_offset_says():
    """A satellite on the x axis, the Sun on y: body z is -x, body x is +y, body y is z cross Sun, -z."""
    place, sun = np.array((26_560e3, 0.0, 0.0)), np.array((0.0, 1.5e11, 0.0))
    moved = phase_centre.antenna_m(place, sun, np.array((0.279, 0.1, 2.5))) - place
    # The Sun is not infinitely far: 0.18 mrad.
    assert moved == pytest.approx((-2.5, 0.279, -0.1), abs=5e-4)


def test_a_sun_in_line_with_satellite_and_earth_leaves_numbers():
    place = np.array((26_560e3, 0.0, 0.0))
    moved = phase_centre.antenna_m(place, np.array((1.5e11, 0.0, 0.0)), np.array((0.279, 0.0, 2.5)))
    assert moved == pytest.approx(place - (2.5, 0, 0))


@pytest.mark.parametrize(
    ("name", "day", "expected"),
    [
        # igs05.atx, week 1627: BLOCK IIA G01 (G032) until 2008-10-16, G037 from 2008-10-23, IIR-M G049.
        ("G01", date(2008, 10, 1), (0.279, 0, 2.201)),
        ("G01", date(2008, 12, 1), (0.279, 0, 2.220)),
        ("G01", date(2010, 7, 27), (0, 0, 0.700)),
        # IIR-A G13, IIR-B G23, IIA G32 (G023).
        ("G13", date(2010, 7, 27), (0, 0, 1.203)),
        ("G23", date(2010, 7, 27), (0, 0, 0.602)),
        ("G32", date(2010, 7, 27), (0.279, 0, 2.575)),
        # The first IIF: 1.093 m until week 1602; igs08_1706.atx later.
        ("G25", date(2010, 7, 27), (0.394, 0, 1.093)),
        ("G25", date(2010, 12, 1), (0.394, 0, 1.407)),
        ("G25", date(2023, 3, 23), (0.394, 0, 1.597)),
        ("G04", date(2023, 3, 23), (0, 0, 1.930)),
        ("R01", date(2009, 4, 1), (0, 0, 1.944)),
        ("R01", date(2010, 7, 27), (-0.545, 0, 2.300)),
        ("R05", date(2020, 1, 1), (-0.545, 0, 2.450)),
    ],
)
def test_published_offsets(name, day, expected):
    assert phase_centre.offsets_m(day)[satellites.parse(name)].tolist() == pytest.approx(expected)


def test_systems_without_offsets_have_none():
    offsets = phase_centre.offsets_m(date(2023, 3, 23))
    assert np.isnan(offsets[satellites.parse("E11")]).all()
    assert np.isnan(offsets[satellites.index(satellites.GPS, 0)]).all()


@pytest.mark.parametrize(("day", "unlike"), [(date(2009, 4, 1), {1}), (date(2023, 3, 23), set())])
def test_blocks_are_those_of_the_link_budget(day, unlike):
    """Another table, from launch dates, by another hand: a block's x tells which it is. It lacks space
    vehicle 49, a week old on the first day."""
    of_lockheed = ("gps-iir", "gps-iir-improved", "gps-iirm", "gps-iii")
    x_m = {"gps-iia": 0.279, "gps-iif": 0.394, **dict.fromkeys(of_lockheed, 0.0)}
    offsets, blocks = phase_centre.offsets_m(day), gps_blocks(day)
    for number in set(range(1, 33)) - unlike:
        assert offsets[satellites.index(satellites.GPS, number), 0] == x_m[blocks[number]], number
