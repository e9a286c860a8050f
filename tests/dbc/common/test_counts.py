"""Counts in words."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.common.counts import noun, so_many

pytestmark = pytest.mark.verifies(
    "dbc/common/counts.py", what="Counts in words", by="English: one of one, many of none", status="validated"
)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((0, "epoch"), "0 epochs"),
        ((1, "epoch"), "1 epoch"),
        ((2, "epoch"), "2 epochs"),
        ((1, "frame is", "frames are"), "1 frame is"),
        ((3, "frame is", "frames are"), "3 frames are"),
        ((1, "time mark"), "1 time mark"),
    ],
)
def test_the_word_goes_with_its_number(given, said):
    assert so_many(*given) == said
    assert noun(*given) == said.split(" ", 1)[1]
