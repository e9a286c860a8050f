"""Words of `detected_by` and the checks that they mean."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.faults.checks import CHECKS
from gnss_hil.tools.results import checks
from gnss_hil.tools.results.detectors import NOTHING, ROWS, by_word

pytestmark = pytest.mark.verifies(
    "tools/results/detectors.py",
    what="Faults: checks by the words of expectations",
    by="the table of checks, and epochs made up by the test",
    status="validated",
)


def test_every_word_but_none_means_checks_that_a_record_may_have():
    assert list(ROWS) == list(CHECKS)
    assert {word for word, rows in ROWS.items() if not rows} == {NOTHING}
    assert {*checks.REJECTIONS, checks.LOST, checks.SILENCE, checks.RESTART, checks.MARK} & {
        row for rows in ROWS.values() for row in rows
    }


def test_epochs_of_a_word_are_those_of_its_checks_each_once():
    found = by_word({"MARK": np.array([7, 9]), "JUMPED": np.array([9, 8]), "LOST": np.array([1])})
    assert found["mark"].tolist() == [7, 8, 9] and found["lost"].tolist() == [1]
    assert not len(found["silence"]) and not len(found[NOTHING])
