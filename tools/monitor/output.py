"""The two faces of the monitor: a table on a terminal, lines in a pipe."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.live.terminal import Terminal
from gnss_hil.tools.monitor.filter import FrameFilter
from gnss_hil.tools.monitor.format import Formatter
from gnss_hil.tools.monitor.lines import Decoded, Printer, Raw
from gnss_hil.tools.monitor.stats import BusStats
from gnss_hil.tools.monitor.table import screen

DRAW_S = 0.25
PATIENCE_S = 1.0
"""At the end, how long a slow reader may take for the last lines."""


class Table:
    """Draws four times a second; a terminal that is held (Ctrl-S) is passed over."""

    left_out = 0

    def __init__(
        self,
        terminal: Terminal,
        stats: BusStats,
        wanted: FrameFilter,
        formatter: Formatter,
        raw: bool,
        spec: str,
    ):
        self._terminal, self._stats, self._spec = terminal, stats, spec
        self._wanted, self._formatter, self._raw = wanted, formatter, raw
        self._begun = time.monotonic()
        self._next = 0.0

    def hear(self, frames: FrameBatch, verdict: NDArray[np.uint8]) -> None:
        """The stats has heard it already."""

    def refresh(self, dropped: int) -> None:
        now = time.monotonic()
        if now < self._next or not self._terminal.ready:
            return
        self._next = now + DRAW_S
        head = [
            self._spec,
            f"{now - self._begun:.0f} s",
            *([f"{dropped} lost on the way"] if dropped else []),
        ]
        size = self._terminal.size
        self._terminal.draw(screen(self._stats, self._wanted, self._formatter, head, self._raw, now, size))

    def close(self) -> None:
        self._terminal.leave()


class Piped:
    """One line a frame. BrokenPipeError, or what else writing raised, comes with the next `refresh`."""

    def __init__(self, descriptor: int, wanted: FrameFilter, formatter: Formatter, raw: bool, spec: str):
        bus = "".join(c for c in spec.rpartition(":")[2].rpartition("/")[2] if c.isalnum()) or "can"
        self._printer = Printer(descriptor, Raw(bus) if raw else Decoded(formatter))
        self._wanted = wanted

    @property
    def left_out(self) -> int:
        return self._printer.left_out

    def hear(self, frames: FrameBatch, verdict: NDArray[np.uint8]) -> None:
        shown = self._wanted.of(frames.can_id)
        if shown.any():
            self._printer.put(time.time_ns() // 1000, frames[shown], verdict[shown])

    def refresh(self, dropped: int) -> None:
        if self._printer.failure is not None:
            raise self._printer.failure

    def close(self) -> None:
        self._printer.close(PATIENCE_S)
