"""Which faults are armed, act and are over, while the run goes on: from the growing file of what they did."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from gnss_hil.emulator.faults import ledger
from gnss_hil.emulator.faults.engine import FaultPlan
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.tools.live.summary import FaultsSummary

FRESH_S = 1.5
"""What was written so lately is now: the emulator writes once a second at least."""


class LiveFaults:
    """Faults of a run's plans by name. They act as long as the file says so in each look."""

    def __init__(self, path: Path, plans: Sequence[FaultPlan]):
        self._path = path
        self._names = [[one.name for one in plan.armed] for plan in plans]
        self._elsewhere = [[not KINDS[one.kind].frames for one in plan.armed] for plan in plans]
        self._file: BinaryIO | None = None
        self._rest = b""
        self._acting: tuple[str, ...] = ()
        self._acted: set[str] = set()
        self._grown_s = 0.0

    def look(self, now_s: float | None = None) -> FaultsSummary | None:
        """How they stand at a wall-clock time; None where none are armed."""
        every = list(dict.fromkeys(name for names in self._names for name in names))
        if not every:
            return None
        now_s = time.monotonic() if now_s is None else now_s
        if lines := self._lines():
            self._grown_s = now_s
            self._acting = self._within_windows(lines)
            self._acted.update(self._acting)
        acting = self._acting if now_s - self._grown_s < FRESH_S else ()
        return FaultsSummary(
            acting,
            tuple(name for name in every if name in self._acted and name not in acting),
            tuple(name for name in every if name not in self._acted),
        )

    def _lines(self) -> list[str]:
        """Whole lines that have come since the last look; the first of the file is none of an event."""
        if self._file is None:
            if not self._path.exists():
                return []
            self._file = self._path.open("rb")
            self._rest = self._file.readline()
            if self._rest.endswith(b"\n"):
                self._rest = b""
            else:  # its first line is not there yet
                self._file.close()
                self._file, self._rest = None, b""
                return []
        *whole, self._rest = (self._rest + self._file.read()).split(b"\n")
        return [line.decode() + "\n" for line in whole]

    def _within_windows(self, lines: Sequence[str]) -> tuple[str, ...]:
        """Names of the faults that act in any epoch of some lines, each once: on frames, or elsewhere."""
        return tuple(
            dict.fromkeys(
                self._names[craft][event.fault]
                for craft, event in ledger.events(lines)
                if event.since >= 0 and (event.touched or self._elsewhere[craft][event.fault])
            )
        )

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
