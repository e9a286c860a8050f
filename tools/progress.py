"""Where a run stands: one line that is rewritten on a terminal, a plain line now and then in a pipe."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from typing import TextIO

TERMINAL_S = 0.2
PIPE_S = 10.0


@dataclass(frozen=True, slots=True)
class Standing:
    """simulated_s since the start, and what the last epoch's navigation said; error_m if truth is at hand."""

    simulated_s: float
    mode: str = ""
    satellites: int = 0
    pdop: float = float("nan")
    error_m: float | None = None


def clock(seconds: float) -> str:
    """'1 d 02:03:04', '00:10:00'."""
    days, rest = divmod(int(seconds), 86400)
    text = f"{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"
    return f"{days} d {text}" if days else text


class Progress:
    """Prints standings as they fall due. `due` is cheap: ask it every epoch."""

    def __init__(self, name: str, duration_s: float, stream: TextIO | None = None, quiet: bool = False):
        self._name = name
        self._duration_s = duration_s
        self._stream = sys.stderr if stream is None else stream
        self._terminal = self._stream.isatty()
        self._every_s = TERMINAL_S if self._terminal else PIPE_S
        self._begun = time.monotonic()
        self._next = float("inf") if quiet else self._begun + self._every_s
        self._width = 0

    def due(self) -> bool:
        return time.monotonic() >= self._next

    def show(self, standing: Standing) -> None:
        now = time.monotonic()
        self._next = now + self._every_s
        line = self._line(standing, now - self._begun)
        if self._terminal:
            self._stream.write("\r" + line.ljust(self._width))
            self._width = len(line)
        else:
            self._stream.write(line + "\n")
        self._stream.flush()

    def note(self, text: str) -> None:
        """A line of its own."""
        self.close()
        self._stream.write(text + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Leave the terminal on a fresh line."""
        if self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._width = 0
            self._stream.flush()

    def _line(self, s: Standing, wall_s: float) -> str:
        parts = [
            f"{self._name}  {clock(s.simulated_s)} of {clock(self._duration_s)}",
            f"{100 * s.simulated_s / self._duration_s:3.0f} %",
            f"{s.simulated_s / wall_s:.0f}x" if wall_s > 0 else "",
        ]
        if s.mode in ("", "NO_FIX"):
            parts.append("no fix yet" if s.mode else "waiting")
        else:
            parts.append(f"{s.satellites} satellites")
            parts.append(f"PDOP {s.pdop:.2f}")
        if s.error_m is not None:
            parts.append(f"error {s.error_m:.2f} m")
        return "  ".join(p for p in parts if p)
