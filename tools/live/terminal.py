"""A terminal that is drawn upon: the alternate screen, entered at the first draw and left clean.

Every line is placed by its row and automatic wrapping is off, so nothing can scroll, whatever the size.
"""

from __future__ import annotations

import os
import select
from collections.abc import Sequence
from typing import TextIO

from gnss_hil.tools.live.screen import Line, painted, width_of

# ECMA-48 and xterm's private modes: alternate screen (1049), wrapping (7), cursor (25).
ENTER = "\x1b[?1049h\x1b[?7l\x1b[?25l\x1b[2J"
LEAVE = "\x1b[0m\x1b[?25h\x1b[?7h\x1b[?1049l"
_ERASE_LINE, _ERASE_BELOW, _HOME = "\x1b[K", "\x1b[J", "\x1b[H"

USUAL = os.terminal_size((80, 24))


def can_draw(stream: TextIO) -> bool:
    """Whether a stream is a terminal that knows how to place a cursor."""
    return stream.isatty() and os.environ.get("TERM", "dumb") not in ("", "dumb")


class Terminal:
    """Draws whole screens; the size is asked for at each draw, so a resized window is right at the next."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._colour = not os.environ.get("NO_COLOR")
        self._inside = False

    @property
    def size(self) -> os.terminal_size:
        size = os.get_terminal_size(self._stream.fileno())
        return size if size.columns and size.lines else USUAL

    @property
    def ready(self) -> bool:
        """Whether it takes text now: one that is held (Ctrl-S) must not hold the bus."""
        return bool(select.select([], [self._stream], [], 0)[1])

    def draw(self, lines: Sequence[Line]) -> None:
        """These lines and nothing else; of more than fit, the first."""
        columns, count = self.size
        rows = [
            f"\x1b[{row}H{painted(spans, self._colour)}{_ERASE_LINE if width_of(spans) < columns else ''}"
            for row, spans in enumerate(lines[:count], 1)
        ]  # erasing behind a full line would take its last character: without wrapping the cursor stays on it
        below = f"\x1b[{len(rows) + 1}H{_ERASE_BELOW}" if len(rows) < count else ""
        self._write(("" if self._inside else ENTER) + "".join(rows) + below + _HOME)
        self._inside = True

    def leave(self) -> None:
        """Back to the screen as it was; may be called twice."""
        if self._inside:
            self._inside = False
            self._write(LEAVE)

    def say(self, text: str) -> None:
        """A line that stays, on the ordinary screen."""
        self.leave()
        self._write(text + "\n")

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()
