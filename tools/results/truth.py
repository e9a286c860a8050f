"""The truth stream of a run: one JSON line that describes the rows, then rows as raw bytes.

Written as it happens; whatever dies, the whole rows up to then can be read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np


class TruthError(ValueError):
    """A truth file that cannot be read; the message is for people."""


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """craft names, and rows of `gnss_hil.emulator.truth.TRUTH` in the order of epochs."""

    craft: tuple[str, ...]
    rows: np.ndarray

    def of(self, name: str) -> np.ndarray:
        """Rows of one craft, by time."""
        if len(self.craft) == 1:
            return self.rows
        return self.rows[self.rows["craft"] == self.craft.index(name)]


def read(path: Path) -> Truth:
    """The truth of a run; a last row cut short (a crash) is left out."""
    try:
        with Path(path).open("rb") as stream:
            header = json.loads(stream.readline())
            kind = np.dtype(
                [tuple(tuple(p) if isinstance(p, list) else p for p in f) for f in header["dtype"]]
            )
            begin = stream.tell()
            whole = (stream.seek(0, 2) - begin) // kind.itemsize
    except OSError as error:
        raise TruthError(f"{path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise TruthError(f"{path}: not a truth file (its first line describes the rows)") from None
    rows = np.memmap(path, kind, "r", begin, (whole,)) if whole else np.zeros(0, kind)
    return Truth(tuple(header["craft"]), rows)


def at_fixes(
    fixes: Mapping[str, np.ndarray], rows: np.ndarray
) -> tuple[Mapping[str, np.ndarray], np.ndarray]:
    """The valid fixes (n,) of whose instant there is a truth, and its rows (n,)."""
    if not len(rows) or not fixes:
        return {}, rows[:0]
    at = np.minimum(np.searchsorted(rows["t_gps_ns"], fixes["t_ns"]), len(rows) - 1)
    found = fixes["valid"] & (rows["t_gps_ns"][at] == fixes["t_ns"])
    return {name: column[found] for name, column in fixes.items()}, rows[at[found]]
