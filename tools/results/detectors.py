"""Which rows of checks.parquet each word of `detected_by` means (`gnss_hil.emulator.faults.checks`).

Several words may mean the same row: on the bus a range that no orbit allows and one that does not fit the
others are both a satellite that is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.emulator.faults.checks import CHECKS

NOTHING = "none"
"""Expected of a fault that nothing tells."""

_OTHERWISE: Mapping[str, tuple[str, ...]] = {
    "mark": ("MARK", "NO_TIME_MARK", "BAD_TIME_MARK", "JUMPED", "WITHOUT_TIME"),
    "no-answer": ("NO_ANSWER", "OTHER_ANSWER", "UNHEEDED"),
    "timeout": ("TIMED_OUT", "INCOMPLETE"),
    "wrong-sequence": ("WRONG_SEQUENCE", "STREAM_NOT_VALID"),
    "attitude": ("TURNED", "ATTITUDE_HELD", "WITHOUT_ATTITUDE"),
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


NEAREST = (
    "corrupted", "wrong-length", "unknown-id", "repeated", "mixed-epoch", "wrong-sequence", "bench",
    "restart", "mark", "attitude", "satellite", "health", "receiver", "exclusion", "innovation", "range",
    "no-answer", "silence", "timeout", "lost",
)  # fmt: skip
"""Words from the one nearest to a cause on: frames that are wrong make a node silent, and not the reverse."""


@dataclass(frozen=True, slots=True, eq=False)
class Sign:
    """A check that saw something at a place: the word for it, where, and the epochs (k,) in which it did.

    by   whose check it is: the bench's or the flight software's
    """

    word: str
    where: str
    epochs: I64
    by: str = ""


def signs(seen: Mapping[tuple[str, str, str], I64]) -> list[Sign]:
    """Signs of what checks saw, (check, where, by) -> epochs, by each word that means the check."""
    return [
        Sign(word, where, np.unique(epochs), by)
        for word, checks in ROWS.items()
        for (check, where, by), epochs in seen.items()
        if check in checks
    ]
