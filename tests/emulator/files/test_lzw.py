"""Files of compress: against the program itself, as the package ncompress has it, and against damage."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ncompress import compress

from gnss_hil.emulator.files.lzw import expanded

pytestmark = pytest.mark.verifies(
    "emulator/files/lzw.py", what="Files of compress (.Z)", by="ncompress", status="validated"
)

PLENTY = 1 << 24


def told(seed, size, symbols):
    return np.random.default_rng(seed).integers(0, symbols, size, np.uint8).tobytes()


@pytest.mark.parametrize(
    "data",
    [
        b"", b"x", b"a" * 100_000, told(1, 300_000, 4), told(2, 300_000, 256),
        told(3, 400_000, 2) + told(4, 200_000, 256),
    ],
    ids=["empty", "one", "repeated", "a full table", "all bytes", "cleared when it grows worse"],
)  # fmt: skip
def test_what_compress_made_is_expanded(data):
    assert expanded(compress(data), PLENTY) == data


@given(st.binary(max_size=3000), st.integers(1, 40))
def test_anything_comes_back(data, times):
    assert expanded(compress(data * times), PLENTY) == data * times


@given(st.binary(max_size=400))
def test_any_codes_are_expanded_or_refused(rest):
    for flags in (0x90, 0x10, 0x89, 0x0C):
        try:
            expanded(b"\x1f\x9d" + bytes([flags]) + rest, PLENTY)
        except ValueError:
            continue


def test_damage_and_size():
    whole = compress(b"a" * 10_000)
    for bad in (b"\x1f\x9d", b"\x1f\x9d\x85" + whole[3:], whole[:3] + b"\xff" * 20):
        with pytest.raises(ValueError):
            expanded(bad, PLENTY)
    assert expanded(whole, 10_000) == b"a" * 10_000
    assert expanded(whole, 9_999) is None


def test_bits_left_over_tell_most_cuts():
    """What is left of a code cut in two is eight bits or more, or not zero."""
    whole = compress(told(5, 4_000, 256))
    read = 0
    for end in range(3, len(whole)):
        try:
            expanded(whole[:end], PLENTY)
        except ValueError:
            continue
        read += 1
    assert read < 0.4 * len(whole)
