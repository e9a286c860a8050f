"""Patterns: look-ups, closed ends, what an axial ratio means, no antenna that radiates more than it gets."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.emulator.constellation.block_types import BLOCKS
from gnss_hil.emulator.signal import antenna_patterns, link_budget, simple_link_budget
from gnss_hil.emulator.signal.antenna_patterns import Pattern

TRANSMIT = ("gps-iia", "gps-iir", "gps-iir-improved", "gps-iif")


def of(*rows):
    angle, gain = np.array(rows, float).T
    return Pattern(angle, gain, "test")


@pytest.mark.verifies(
    "emulator/signal/antenna_patterns.py",
    what="Receive patterns",
    by="NumPy interpolation; the law of the plain budget",
    status="validated",
)
@given(st.lists(st.floats(0, np.pi), min_size=1, max_size=50))
def test_look_up_is_linear_interpolation(angles):
    table = antenna_patterns.on_grid(of((0, 12), (20, 3), (25, -40), (60, -5), (180, -20)), 0.0)
    found = antenna_patterns.look_up(np.array([table * 0, table]), 1, np.array(angles))
    expected = np.interp(np.degrees(angles), (0, 20, 25, 60, 180), (12, 3, -40, -5, -20))
    assert found == pytest.approx(expected, abs=1e-9)


def test_the_whole_sphere_has_a_value():
    tables = antenna_patterns.receive((of((0, 4), (90, -6)),), -30.0)
    angle = np.array([[0.0, np.pi / 2, np.pi, np.nextafter(np.pi, 4)]])
    assert antenna_patterns.gain_dbi(tables, angle)[0] == pytest.approx([4, -6, -30, -30])


def test_behind_its_last_angle_a_pattern_has_nothing():
    tables = antenna_patterns.receive((of((0, 4), (90, -6)),))
    angle = np.radians([[0.0, 90.0, 90.25, 135.0, 180.0]])
    assert antenna_patterns.gain_dbi(tables, angle)[0] == pytest.approx(
        [4, -6, *[antenna_patterns.ABSENT_DB] * 3]
    )


@pytest.mark.parametrize("level", ["typical", "minimum"])
def test_no_satellite_sends_backwards(level):
    """Behind 90 deg no block has a published pattern: on no carrier is anything heard of it there, whose
    lobes are wider. At 1000 km a receiver hears what is 170 dB below a watt."""
    everyone = np.arange(512) % len(BLOCKS)
    sent = link_budget.transmit(everyone, level)
    for row in np.unique(sent.row[sent.row > 0]).tolist():
        behind = sent.level_dbwm2[row, antenna_patterns.GRID_DEG > 90]
        assert behind.max() - 20 * np.log10(1e6) < -250
        assert sent.level_dbwm2[row, antenna_patterns.GRID_DEG <= 90].min() > -100


def test_every_antenna_has_its_own_pattern():
    up, down = of((0, 5), (180, 5)), of((0, -5), (180, -5))
    tables = antenna_patterns.receive((up, down, up), 0.0)
    assert len(tables.right_dbi) == 2
    assert antenna_patterns.gain_dbi(tables, np.ones((3, 2))).tolist() == [[5, 5], [-5, -5], [5, 5]]


def test_the_law_is_that_of_the_simple_budget():
    angle = np.linspace(0, np.pi, 721)
    table = antenna_patterns.on_grid(antenna_patterns.cosine_law(4.0, -6.0), 0.0)
    assert table == pytest.approx(simple_link_budget.gain_dbi(np.cos(angle), 4.0, -6.0), abs=1e-12)


@pytest.mark.verifies(
    what="Transmit patterns: GPS IIA and IIF, side lobes of GLONASS-M, all beyond",
)
@pytest.mark.parametrize("name", TRANSMIT)
def test_no_antenna_radiates_more_than_it_is_fed(name):
    """The mean of the gain over the sphere is the efficiency; means in dB make it a little less."""
    angle = np.radians(antenna_patterns.GRID_DEG)
    gain = 10 ** (antenna_patterns.on_grid(link_budget.shipped(name)) / 10)
    efficiency = np.trapezoid(gain * np.sin(angle), angle) / 2
    assert 0.5 < efficiency < 1.0


@pytest.mark.parametrize("name", ("cone-20deg", "cone-12deg"))
def test_cones_have_their_null_towards_the_whole_earth(name):
    """From the geostationary orbit the Earth is 8.7 deg wide on either side."""
    table = antenna_patterns.on_grid(link_budget.shipped(name), 0.0)
    edge_deg = np.degrees(np.arcsin(6378.137 / 42164))
    earth = edge_deg >= antenna_patterns.GRID_DEG
    assert (table[earth] == table.max() - 80).all()
