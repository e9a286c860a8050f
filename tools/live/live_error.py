"""How far the fix is from the truth, while the run goes on: from the end of the growing truth file."""

from __future__ import annotations

from collections import deque
from pathlib import Path

import numpy as np

from gnss_hil.tools.decoder.epoch_snapshot import EpochSnapshot
from gnss_hil.tools.results import truth

_KEPT = 64
"""Fixes that wait for their truth, which comes up to a second later: some seconds of looks."""


class LiveError:
    """3-D error of the latest fix for which the truth is there.

    Truth rows are one for each epoch and craft, in that order, so a row is found by its number.
    """

    def __init__(self, path: Path, craft: int, crafts: int):
        self._path = path
        self._craft, self._crafts = craft, crafts
        self._waiting: deque[tuple[int, int, np.ndarray]] = deque(maxlen=_KEPT)
        self.error_m: float | None = None

    def look(self, snapshot: EpochSnapshot, interval_ns: int) -> None:
        """Take in the fix of an epoch, and compare those whose truth is there."""
        fix = snapshot.fix
        if fix is None or snapshot.t_ns is None or np.isnan(fix.position_ecef_m).any():
            self.error_m = None
            self._waiting.clear()
            return
        t_ns = snapshot.t_ns - (snapshot.epoch - fix.epoch) * interval_ns
        self._waiting.append((fix.epoch * self._crafts + self._craft, t_ns, fix.position_ecef_m))
        try:
            rows = truth.read(self._path).rows
        except truth.TruthError:  # not begun yet, or none is written
            return
        ready = [fix for fix in self._waiting if fix[0] < len(rows)]
        if ready:
            number, t_ns, position_ecef_m = ready[-1]
            row = rows[number]
            same = int(row["t_gps_ns"]) == t_ns
            self.error_m = float(np.linalg.norm(position_ecef_m - row["position_ecef_m"])) if same else None
            while self._waiting and self._waiting[0][0] < number:
                self._waiting.popleft()
