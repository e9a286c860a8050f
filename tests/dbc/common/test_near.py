"""What was probably meant."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.common.near import did_you_mean, nearest

pytestmark = pytest.mark.verifies(
    "dbc/common/near.py",
    what="Words that were probably meant",
    by="difflib's ratio, of the standard library",
    status="validated",
)


@pytest.mark.parametrize(("word", "meant"), [("pollicy", "policy"), ("SEED", "seed"), ("zzz", None)])
def test_the_nearest_word_or_none(word, meant):
    assert nearest(word, ["policy", "seed", "sky"]) == meant


def test_without_a_near_word_all_are_named():
    assert did_you_mean("zzz", ["seed", "sky"]) == "allowed are seed, sky"
    assert did_you_mean("sed", ["seed", "sky"]) == "did you mean 'seed'?"
