"""Charts of characters: they fit, their bars are as high as the values, time runs from left to right."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.tools.live.chart import History, chart, round_up
from gnss_hil.tools.live.screen import plain, width_of

pytestmark = pytest.mark.verifies(
    "tools/live/chart.py",
    what="Live view: charts over time",
    by="bars known without a computer; charts of any values and size",
    status="validated",
)

NAN = math.nan


def drawn(values, width=20, height=6):
    return [plain(spans) for spans in chart("error", "m", list(range(len(values))), values, width, height)]


def test_a_line_that_rises_is_a_staircase_with_a_scale_and_a_time():
    lines = drawn([float(v) for v in range(1, 14)])
    assert lines[0].startswith("error [m]  now 13")
    assert lines[1].startswith("    15 ") and lines[4].startswith("     0 ")
    assert lines[5].rstrip().endswith("00:00:12") and lines[5].strip().startswith("0:00")
    columns = ["".join(text[7 + k] for text in lines[1:5]) for k in range(13)]
    assert columns[0] == "   ▂" and columns[7] == " ▁██"
    heights = [sum(" ▁▂▃▄▅▆▇█".index(c) for c in column) for column in columns]
    assert heights == sorted(heights)


def test_a_wild_value_is_cut_and_coloured_and_a_gap_is_a_dot():
    values = [50.0, *[0.5] * 30, NAN, *[0.5] * 8]
    lines = chart("error", "m", list(range(40)), values, 47, 6)
    assert "1.5 " in plain(lines[1])[:7]
    assert [span.text for span in lines[1] if span.style == "warn"] == ["█"]
    assert plain(lines[4])[7 + 31] == "·" and plain(lines[1])[7 + 31] == " "


def test_nothing_yet_is_said():
    assert "nothing yet" in drawn([NAN, NAN])[1]


def test_columns_between_two_looks_are_filled():
    lines = drawn([2.0, 2.0], width=27)
    assert plain_bars(lines[4]) == "█" * 20


def plain_bars(text: str) -> str:
    return text[7:]


@pytest.mark.parametrize(
    ("value", "top"), [(0, 1), (0.31, 0.4), (1, 1), (1.01, 1.5), (24, 25), (9e-3, 0.01), (NAN, 1)]
)
def test_scales_end_at_round_numbers(value, top):
    assert round_up(value) == top


@given(
    st.lists(st.floats(0, 1e9) | st.just(NAN), min_size=1, max_size=200),
    st.integers(10, 120),
    st.integers(3, 30),
)
def test_a_chart_fits_whatever_it_shows(values, width, height):
    lines = chart("error", "m", [0.25 * k for k in range(len(values))], values, width, height)
    assert len(lines) <= height and all(width_of(spans) == width for spans in lines)


def test_a_history_stays_small_and_keeps_its_beginning():
    history = History()
    for k in range(20_000):
        history.add(float(k), 1.0 if k % 2 else None, k % 7)
    assert 2000 < len(history.t_s) <= 4096 and len(history.t_s) == len(history.satellites)
    assert history.t_s == sorted(history.t_s) and history.t_s[0] < 100 and history.t_s[-1] == 19_999
