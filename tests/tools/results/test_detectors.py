"""Words of `detected_by` and the checks that they mean."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.emulator.faults.checks import CHECKS
from gnss_hil.tools.results import checks
from gnss_hil.tools.results.detectors import NEAREST, NOTHING, ROWS, signs

pytestmark = pytest.mark.verifies(
    "tools/results/detectors.py",
    what="Faults: checks by the words of expectations",
    by="the table of checks, and epochs made up by the test",
    status="validated",
)


def test_every_word_but_none_means_checks_that_a_record_may_have():
    assert list(ROWS) == list(CHECKS)
    assert {word for word, rows in ROWS.items() if not rows} == {NOTHING}
    assert not {row for rows in ROWS.values() for row in rows} - {*checks.CHECKS}


def test_every_word_has_its_distance_from_a_cause():
    assert sorted(NEAREST) == sorted({*ROWS} - {NOTHING})


def test_a_sign_is_of_a_word_and_a_place_its_epochs_in_order():
    seen = {
        ("MARK", "TIME", "BENCH"): [7, 9],
        ("JUMPED", "TIME_MARK", "FLIGHT"): [9, 8, 8],
        ("EXCLUDED_SATELLITE", "G07", "FLIGHT"): [1],
    }
    found = [
        (one.word, one.where, one.by, one.epochs.tolist())
        for one in signs({key: np.array(epochs) for key, epochs in seen.items()})
    ]
    assert found == [
        ("mark", "TIME", "BENCH", [7, 9]), ("mark", "TIME_MARK", "FLIGHT", [8, 9]),
        ("range", "G07", "FLIGHT", [1]), ("exclusion", "G07", "FLIGHT", [1]),
    ]  # fmt: skip
