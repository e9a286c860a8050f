"""What shows a run while it goes on: the supervisor and the inline loop know this face and no more."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Protocol

from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.live.progress import Progress
from gnss_hil.tools.live.terminal import Terminal, can_draw
from gnss_hil.tools.run_config.plan import Plan


class Display(Protocol):
    """Hears every epoch; draws now and then."""

    def hear(self, craft: int, epoch: int, frames: FrameBatch) -> None:
        """The frames of an epoch, as recorded; called for every epoch, so cheap."""

    def refresh(self, unanswered: int = 0) -> None:
        """Called often, several times a second at least; `unanswered` epochs so far."""

    def note(self, text: str) -> None:
        """A line of its own that stays."""

    def close(self) -> None:
        """Leave the terminal as it was, on a fresh line."""


def open_display(plan: Plan, truth: Path, quiet: bool, plain: bool = False) -> Display:
    """The live view if stderr is a terminal, else a line now and then; `truth` is the file that grows while
    the run goes on, `plain` asks for lines in any case."""
    if quiet or plain or not can_draw(sys.stderr):
        return Progress(plan, quiet=quiet)
    from gnss_hil.tools.live.view import LiveView

    return LiveView(plan, truth, Terminal(sys.stderr))
