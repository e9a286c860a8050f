"""How far a long piece of work is: a line on a terminal, nothing in a pipe."""

from __future__ import annotations

import sys
import time

EVERY_S = 0.2


class Ticker:
    """unit  what is counted"""

    def __init__(self, unit: str, quiet: bool = False):
        self._unit = unit
        self._next = time.monotonic() + EVERY_S if sys.stderr.isatty() and not quiet else float("inf")
        self._width = 0

    def show(self, count: int, share: float | None = None) -> None:
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + EVERY_S
        percent = "" if share is None else f"  {100 * share:3.0f} %"
        line = f"{count} {self._unit}{percent}"
        sys.stderr.write("\r" + line.ljust(self._width))
        sys.stderr.flush()
        self._width = len(line)

    def close(self) -> None:
        """Leave the terminal on a fresh line."""
        if self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()
            self._width = 0
