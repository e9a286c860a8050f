"""The truth stream of a run: one JSON line that describes the rows, then rows as raw bytes.

Written as it happens; whatever dies, the whole rows up to then can be read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gnss_hil.dbc.common.arrays import I64
from gnss_hil.tools.results import trajectory


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
    """The valid fixes (n,) of whose instant truth is known, and the truth there, rows (n,)."""
    if not len(rows) or not fixes:
        return {}, rows[:0]
    there = at(fixes["t_ns"], rows)
    found = fixes["valid"] & (there["t_gps_ns"] == fixes["t_ns"])
    return {name: column[found] for name, column in fixes.items()}, there[found]


INTERPOLATED = ("position_ecef_m", "velocity_ecef_mps", "clock_s")
"""What is known between rows too."""


def at(t_ns: I64, rows: np.ndarray) -> np.ndarray:
    """Truth at instants (k,), rows (k,): position and velocity as `trajectory` has them, clocks in a straight
    line between rows, the rest of the row before. Where nothing is known `t_gps_ns` is that of another
    instant."""
    before = np.maximum(np.searchsorted(rows["t_gps_ns"], t_ns, side="right") - 1, 0)
    found = rows[before]
    between = found["t_gps_ns"] != t_ns
    if not between.any():
        return found
    asked_ns = t_ns[between]
    position, velocity = trajectory.states(
        rows["t_gps_ns"], rows["position_ecef_m"], rows["velocity_ecef_mps"], asked_ns
    )
    moved = found[between]
    moved["position_ecef_m"], moved["velocity_ecef_mps"] = position, velocity
    for domain, clock_s in enumerate(rows["clock_s"].T):
        moved["clock_s"][:, domain] = np.interp(asked_ns, rows["t_gps_ns"], clock_s)
    known = np.isfinite(position).all(axis=1)
    moved["t_gps_ns"][known] = asked_ns[known]
    found[between] = moved
    return found
