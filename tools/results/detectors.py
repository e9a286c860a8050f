"""Which rows of checks.parquet each word of `detected_by` means (`gnss_hil.emulator.faults.checks`).

Several words may mean the same row: on the bus a range that no orbit allows and one that does not fit the
others are both a satellite that is left out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.faults.checks import CHECKS

NOTHING = "none"
"""Expected of a fault that nothing tells."""

_OTHERWISE: Mapping[str, tuple[str, ...]] = {
    "mark": ("MARK", "NO_TIME_MARK", "BAD_TIME_MARK", "JUMPED"),
    "timeout": ("TIMED_OUT", "INCOMPLETE"),
    "wrong-sequence": ("WRONG_SEQUENCE", "STREAM_NOT_VALID"),
    "attitude": ("TURNED", "NO_ATTITUDE"),
    "satellite": ("NO_ORBIT", "MOVED"),
    "health": ("UNHEALTHY",),
    "range": ("EXCLUDED_SATELLITE", "NO_CONVERGENCE"),
    "innovation": ("AGAINST_ORBIT",),
    "exclusion": ("EXCLUDED_SATELLITE", "INCONSISTENT_RANGES"),
    "receiver": ("EXCLUDED_RECEIVER",),
    NOTHING: (),
}

ROWS: Mapping[str, tuple[str, ...]] = {
    word: _OTHERWISE.get(word, (word.upper().replace("-", "_"),)) for word in CHECKS
}
"""Of each word the checks of the table that it means."""


def by_word(epochs: Mapping[str, I64]) -> dict[str, I64]:
    """Epochs in which something was seen by each word, of those by the table's checks; in order."""
    none = np.zeros(0, np.int64)
    return {
        word: np.unique(np.concatenate([none, *(epochs[check] for check in checks if check in epochs)]))
        for word, checks in ROWS.items()
    }
