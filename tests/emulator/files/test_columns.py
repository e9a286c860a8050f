"""Fixed columns against Python's own reading and writing of numbers."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from gnss_hil.emulator.files.columns import Lines, decimals, flags


def read(text, places):
    values, bad = decimals(np.frombuffer(text.encode("ascii"), np.uint8)[None], places)
    return values[0], bad[0]


@given(st.integers(-(10**12) + 1, 10**13 - 1), st.sampled_from((3, 6)))
def test_numbers_come_out_as_python_reads_them(ticks, places):
    """To the last bit, sign and all."""
    text = f"{ticks / 10**places:14.{places}f}"
    if len(text) == 14:
        assert read(text, places) == (float(text), False)


@given(st.text(alphabet=" +-.0123456789x", min_size=14, max_size=14))
@example(" " * 14)
def test_nothing_but_fortrans_form_is_a_number(text):
    """Blank, or right-aligned with three digits behind the point, at most a sign before the digits."""
    value, bad = read(text, 3)
    if not text.strip():
        assert math.isnan(value) and not bad
        return
    left, right = text[:10].lstrip(" "), text[11:]
    good = text[10] == "." and right.isdecimal() and (left.lstrip("+-").isdecimal() or left in ("", "+", "-"))
    good &= len(left) - len(left.lstrip("+-")) <= 1
    assert bad == (not good)
    assert (value == float(text)) if good else math.isnan(value)


def test_fields_beyond_a_lines_end_are_blank():
    lines = Lines("abcdef\r\nxy\n\nlast", "x")
    assert lines.text == ["abcdef", "xy", "", "last"]
    found = lines.field(np.arange(4), 1, 4)
    assert [row.tobytes() for row in found] == [b"bcde", b"y   ", b"    ", b"ast "]


def test_single_digits():
    values, bad = flags(np.frombuffer(b" 07x/:", np.uint8)[:, None])
    assert values.tolist()[:3] == [0, 0, 7]
    assert bad.tolist() == [False, False, False, True, True, True]
