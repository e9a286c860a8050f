"""A real terminal for a program: a pseudo-terminal, and pyte as what a person would see on it."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable

import pyte

from tests.support.waiting import HANG_S, exit_status


class Seen(pyte.Screen):
    """pyte's screen with the alternate one: it has none, so leaving that brings back what was before."""

    def __init__(self, columns: int, lines: int):
        super().__init__(columns, lines)
        self.alternate = False
        self.cursor_shown = True

    def set_mode(self, *modes, **more):
        if more.get("private"):
            self.alternate |= 1049 in modes
            self.cursor_shown |= 25 in modes
        super().set_mode(*modes, **more)

    def reset_mode(self, *modes, **more):
        if more.get("private"):
            self.alternate &= 1049 not in modes
            self.cursor_shown &= 25 not in modes
        super().reset_mode(*modes, **more)


class Session:
    """`gnss-hil ...` with a terminal as its stdin, stdout and stderr, unless a pipe is given."""

    def __init__(
        self,
        *arguments: str,
        columns: int = 80,
        lines: int = 24,
        module: str = "gnss_hil.tools.command_line.main",
    ):
        self.screen = Seen(columns, lines)
        self._stream = pyte.ByteStream(self.screen)
        self._master, slave = pty.openpty()
        self.raw = b""
        self._set_size(columns, lines)
        self.process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
            env={**os.environ, "TERM": "xterm-256color"},
        )  # fmt: skip
        os.close(slave)

    def resize(self, columns: int, lines: int) -> None:
        """As a window does it: the kernel sends SIGWINCH."""
        self.screen.resize(lines, columns)
        self._set_size(columns, lines)

    def _set_size(self, columns: int, lines: int) -> None:
        fcntl.ioctl(self._master, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))

    def type(self, keys: bytes) -> None:
        os.write(self._master, keys)

    def watch(self, until: Callable[[], bool] = lambda: False) -> None:
        """Take in what is written until something is seen, or the program has ended."""
        end = time.monotonic() + HANG_S
        while not until():
            assert time.monotonic() < end, self.text
            if select.select([self._master], [], [], 0.05)[0]:
                try:
                    piece = os.read(self._master, 1 << 16)
                except OSError:  # the last one who had the terminal open is gone
                    return
                self.raw += piece
                self._stream.feed(piece)

    def end(self) -> int:
        self.watch()
        status = exit_status(self.process)
        os.close(self._master)
        return status

    @property
    def text(self) -> str:
        return "\n".join(self.screen.display)


def row(session: Session, beginning: str) -> str:
    """The line of the screen that begins so, "" if there is none."""
    return next((line for line in session.screen.display if line.startswith(beginning)), "")
