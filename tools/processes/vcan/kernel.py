"""A Linux kernel that runs as an ordinary program, from its start to its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import termios
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from gnss_hil.tools.processes.vcan import guard
from gnss_hil.tools.processes.vcan.ending_signals import EndingSignals
from gnss_hil.tools.processes.vcan.machine import MEMORY_FOLDERS, memory_folder, which

_TEMPORARY = ("TMPDIR", "TMP", "TEMP")
"""Variables by which the kernel chooses where its memory lies."""


@dataclass(frozen=True, slots=True)
class Kernel:
    """A kernel to be run: the folder of its scripts, whether it has the terminal, its memory, and what its
    environment needs besides."""

    folder: Path
    terminal: bool
    memory_bytes: int
    environment: Mapping[str, str]

    def run(self, timeout_s: float | None, signals: EndingSignals) -> None:
        """To its end, or to a signal's or the time's; a guard ends it if we cannot."""
        with _guard(self.folder) as tell:
            kernel = self._start()
            try:
                tell(kernel.pid)
                _keep_on_one_processor(kernel.pid)
                with signals.raised():
                    kernel.wait(timeout_s)
            finally:
                if kernel.poll() is None:
                    os.killpg(kernel.pid, signal.SIGKILL)  # its guest processes are processes of ours, too
                    kernel.wait()

    def _start(self) -> subprocess.Popen:
        return subprocess.Popen(
            [
                which("linux.uml") or "linux.uml", f"mem={self.memory_bytes >> 20}M",
                "rootfstype=hostfs", "rootflags=/", "rw", f"init={self.folder}/init",
                "con=null", f"con0={'fd:0' if self.terminal else 'null'},fd:1", "con1=null,fd:2",
                "console=tty9", "quiet", f"uml_dir={self.folder}/",
            ],
            stdin=None if self.terminal else subprocess.DEVNULL,
            process_group=0,
            preexec_fn=_take_terminal if self.terminal else None,
            env={key: value for key, value in os.environ.items() if key not in _TEMPORARY}
            | {"TMPDIR": memory_folder(self.memory_bytes) or MEMORY_FOLDERS[0]}
            | dict(self.environment),
        )  # fmt: skip


def _keep_on_one_processor(process: int) -> None:
    """Kernel and guest processes take turns by ptrace; across two that costs up to five times more."""
    allowed = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(process, {allowed[process % len(allowed)]})


@contextmanager
def _guard(folder: Path) -> Iterator[Callable[[int], None]]:
    """A process that ends the kernel and removes its folder should this one be killed; takes what to end."""
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", guard.__file__, str(folder)],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, process_group=0,
    )  # fmt: skip
    assert process.stdin
    with process.stdin as pipe:

        def tell(group: int) -> None:
            with suppress(BrokenPipeError):  # one that was killed guards nothing
                os.write(pipe.fileno(), str(group).encode())

        try:
            yield tell
        finally:
            process.kill()
            process.wait()


def _take_terminal() -> None:
    """Makes this process's group the terminal's foreground, before it is a kernel: that must neither be
    stopped for touching the terminal nor be reached by the signal that ends such a stop."""
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # else taking it from the background would stop it
    os.tcsetpgrp(sys.stdin.fileno(), os.getpgrp())
    signal.signal(signal.SIGTTOU, signal.SIG_DFL)


@contextmanager
def kept_terminal(terminal: bool):
    """The kernel takes the terminal and makes it raw; afterwards it is ours and as before."""
    if not terminal:
        yield
        return
    before = termios.tcgetattr(sys.stdin)
    try:
        yield
    finally:
        handler = signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # else taking it back would stop us
        os.tcsetpgrp(sys.stdin.fileno(), os.getpgrp())
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        signal.signal(signal.SIGTTOU, handler)
