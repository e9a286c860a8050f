"""Rows that all of several kinds of frames have."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gnss_hil.tools.decoder.channels import common

KEYS = st.lists(st.integers(0, 12), max_size=20)


@given(st.lists(KEYS, min_size=1, max_size=4))
def test_common_keys_are_those_that_every_array_has_exactly_once(lists):
    """In any order, repeated or missing: against plain counting."""
    keys, rows = common([np.array(values, np.int64) for values in lists])
    wanted = [k for k in range(13) if all(values.count(k) == 1 for values in lists)]
    assert keys.tolist() == wanted
    for values, row in zip(lists, rows, strict=True):
        assert np.array(values, np.int64)[row].tolist() == wanted


def test_frames_in_order_are_taken_as_they_are():
    keys, rows = common([np.arange(5), np.arange(5)])
    assert keys.tolist() == list(range(5)) and rows == [slice(None)] * 2
