"""A command in a Linux kernel that runs as an ordinary program.

`shell` boots Debian's user-mode Linux on the host's own files, with vcan0 and vcan1 up, and runs a command
there. It needs neither root nor kernel modules of the host. The kernel ends with the command, at a signal,
and with the process that started it, however that went.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from gnss_hil.tools.processes.vcan import machine, wide_registers
from gnss_hil.tools.processes.vcan.ending_signals import Ended, EndingSignals
from gnss_hil.tools.processes.vcan.guest_scripts import write
from gnss_hil.tools.processes.vcan.kernel import Kernel, kept_terminal
from gnss_hil.tools.processes.vcan.machine import MEMORY_BYTES, MISSING

TIMED_OUT = 124


def shell(command: Sequence[str], timeout_s: float | None = None, memory_bytes: int = MEMORY_BYTES) -> int:
    """Runs a command in a user-mode Linux with vcan0 and vcan1; its exit status.

    Working folder, environment and the host's files are the command's. Its stdin is the terminal if there
    is one, else empty. 3: the kernel is missing or did not boot; 124: `timeout_s` passed; 128 + N: signal N
    asked it to end.
    """
    fault = machine.lacking(memory_bytes)
    if fault:
        print(f"gnss-hil vcan shell: {fault}", file=sys.stderr)
        return MISSING
    with EndingSignals() as signals, tempfile.TemporaryDirectory(prefix="gnss-hil-vcan-") as name:
        folder = Path(name)
        terminal = sys.stdin is not None and sys.stdin.isatty()
        write(folder, command, os.environ, terminal)
        try:
            preloaded = wide_registers.preloaded(folder)
            with kept_terminal(terminal):
                kernel = Kernel(folder, terminal, memory_bytes, preloaded)
                kernel.run(timeout_s, signals)
        except Ended as signalled:
            return 128 + signalled.args[0]
        except subprocess.CalledProcessError:
            print(f"gnss-hil vcan shell: {wide_registers.LACKING}", file=sys.stderr)
            return MISSING
        except subprocess.TimeoutExpired:
            print(f"gnss-hil vcan shell: stopped after {timeout_s:g} s", file=sys.stderr)
            return TIMED_OUT
        return _status(folder)


def _status(folder: Path) -> int:
    with suppress(OSError, ValueError):
        return int((folder / "status").read_text())
    boot = folder / "boot"
    lines = boot.read_text(errors="replace").strip().splitlines() if boot.exists() else []
    print(f"gnss-hil vcan shell: the kernel did not boot{': ' + lines[-1] if lines else ''}", file=sys.stderr)
    return MISSING
