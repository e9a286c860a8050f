"""Lines and grids of a screen: they fit, they lose nothing, and nothing in them orders the terminal about."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.tools.live import layout
from gnss_hil.tools.live.layout import age, arranged
from gnss_hil.tools.live.screen import line, parted, plain, printable, width_of, wrapped

pytestmark = pytest.mark.verifies(
    "tools/live/layout.py",
    "tools/live/screen.py",
    what="Live view: lines and grids",
    by="rules of ours on lines and windows of any size",
    status="modelled",
)


def test_names_cannot_order_the_terminal_about():
    assert printable("soyuz\x1b[2J\n\x9b") == "soyuz?[2J??"
    assert plain(line("a\x1b[31m")) == "a?[31m"


@given(st.lists(st.text(min_size=1, max_size=30), max_size=8), st.integers(1, 100))
def test_parts_fill_a_line_exactly(parts, width):
    assert width_of(parted(parts, width)) == width


@given(st.integers(1, 8), st.integers(1, 32), st.integers(1, 300), st.integers(0, 100))
def test_an_arrangement_never_needs_more_room_than_there_is(antennas, channels, width, height):
    grid = arranged(antennas, channels, width, height)
    rows = -(-antennas // grid.side_by_side)
    assert grid.side_by_side * (grid.width + 2) - 2 <= max(width, grid.width)
    assert grid.channels == 0 or rows * (grid.channels + 2) <= height


def test_wrapping_loses_nothing():
    assert "".join(wrapped("abcdefg", 3)) == "abcdefg" and max(map(len, wrapped("abcdefg", 3))) == 3


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0, "0s"),
        (59.9, "59s"),
        (60, "1m00"),
        (3599, "59m59"),
        (3600, "1h00"),
        (86399, "23h59"),
        (190000, "2d04"),
    ],
)
def test_ages_are_five_characters_at_most(seconds, text):
    assert age(seconds) == text and len(text) <= layout.COLUMNS["age"].width
