"""Waiting for what processes and threads do: until a state is reached or they are dead, never for a time.

A test that judges by the clock fails on a busy machine. There is one limit, far above anything that a loaded
machine needs: it only ends a test that hangs.
"""

from __future__ import annotations

import os
import subprocess
import threading
import time
from collections.abc import Callable
from typing import Any

HANG_S = float(os.environ.get("GNSS_HIL_HANG_S", "600"))
"""Guard against hanging."""

GLANCE_S = 0.02
"""Between two looks at a state."""


def until(condition: Callable[[], Any], *processes: subprocess.Popen) -> Any:
    """What the condition says once it is true; fails when a process that should bring it about has ended.

    The condition is looked at once more after an end: it may have been reached just before.
    """
    end_s = time.monotonic() + HANG_S
    while True:
        over = [process for process in processes if process.poll() is not None]
        if found := condition():
            return found
        assert not over, f"ended with {over[0].returncode}: {last_words(over[0])}"
        assert time.monotonic() < end_s, f"not reached in {HANG_S:.0f} s"
        time.sleep(GLANCE_S)


def last_words(process: subprocess.Popen) -> str:
    """What an ended process printed and was not read yet."""
    return "".join(str(stream.read()) for stream in (process.stdout, process.stderr) if stream)


def ended(process: subprocess.Popen) -> tuple[Any, Any]:
    """Output and errors of a process that ends by itself."""
    return process.communicate(timeout=HANG_S)


def exit_status(process: subprocess.Popen) -> int:
    """Exit status of a process that ends by itself."""
    return process.wait(HANG_S)


def finished(thread: threading.Thread) -> None:
    """A thread that comes to its end."""
    thread.join(HANG_S)
    assert not thread.is_alive(), f"not ended in {HANG_S:.0f} s"


def pause(seconds: float) -> None:
    """Let time pass where that is what is played: a slow node, a machine that stood still.

    Nothing that a test asks for may depend on how much happens meanwhile.
    """
    time.sleep(seconds)
