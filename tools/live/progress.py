"""Where a run stands: one line that is rewritten on a terminal, a plain line now and then in a pipe."""

from __future__ import annotations

import sys
import time
from typing import TextIO

from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.common.durations import clock
from gnss_hil.tools.decoder.block import of_frames
from gnss_hil.tools.decoder.screen import intact
from gnss_hil.tools.run_config.plan import Plan

TERMINAL_S = 0.2
PIPE_S = 10.0


def last_fix(codec: Codec, frames: FrameBatch) -> str:
    """The fix of an epoch's frames in a few words."""
    status = of_frames(codec, frames[intact(codec, frames, "NAV_STATUS")])["NAV_STATUS"]
    if not len(status):
        return "waiting"
    if VALUES["NavMode"].get(int(status["mode"][0])) == "NO_FIX":
        return "no fix yet"
    satellites, pdop = int(status["satellites"][0]), float(status["pdop"][0])
    return f"{satellites or '-'} satellites  PDOP {f'{pdop:.2f}' if pdop else '-'}"


class Progress:
    """A `Display` of one line: where the first craft of a plan stands."""

    def __init__(self, plan: Plan, stream: TextIO | None = None, quiet: bool = False):
        self._name = plan.scenario.name
        self._time = plan.scenario.time
        self._codec = plan.codecs[0]
        self._last: tuple[int, FrameBatch] | None = None
        self._shown = -1
        self._stream = sys.stderr if stream is None else stream
        self._terminal = self._stream.isatty()
        self._every_s = TERMINAL_S if self._terminal else PIPE_S
        self._begun = time.monotonic()
        self._next = float("inf") if quiet else self._begun + self._every_s
        self._width = 0

    def hear(self, craft: int, epoch: int, frames: FrameBatch) -> None:
        if craft == 0:
            self._last = epoch, frames

    def refresh(self, unanswered: int = 0) -> None:
        if self._last is not None and time.monotonic() >= self._next:
            self._show(*self._last)

    def _show(self, epoch: int, frames: FrameBatch) -> None:
        now = time.monotonic()
        self._shown = epoch
        self._next = now + self._every_s
        simulated_s = (epoch + 1) * self._time.epoch_interval_s
        line = self._line(simulated_s, now - self._begun, last_fix(self._codec, frames))
        if self._terminal:
            self._stream.write("\r" + line.ljust(self._width))
            self._width = len(line)
        else:
            self._stream.write(line + "\n")
        self._stream.flush()

    def note(self, text: str) -> None:
        """A line of its own."""
        self._clear()
        self._stream.write(text + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Leave the terminal on a fresh line; in a pipe, where lines stay, the last of them is the end."""
        if not self._terminal and self._last is not None and 0 <= self._shown < self._last[0]:
            self._show(*self._last)
        self._clear()

    def _clear(self) -> None:
        if self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._width = 0
            self._stream.flush()

    def _line(self, simulated_s: float, wall_s: float, fix: str) -> str:
        parts = [
            f"{self._name}  {clock(simulated_s)} of {clock(self._time.duration_s)}",
            f"{100 * simulated_s / self._time.duration_s:3.0f} %",
            f"{simulated_s / wall_s:.0f}x" if wall_s > 0 else "",
            fix,
        ]
        return "  ".join(part for part in parts if part)
