"""Virtual CAN on this machine's own kernel, where that has it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from gnss_hil.tools.processes.vcan.guest_scripts import INTERFACES
from gnss_hil.tools.processes.vcan.machine import MISSING, which

_INTERFACES = Path("/sys/class/net")

_CAP_NET_ADMIN = 12
"""capabilities(7): without it a process changes no interface."""


def up(argv: Sequence[str] = ()) -> int:
    """Creates vcan interfaces on this kernel (vcan0 if none is named); the exit status."""
    for interface in argv or INTERFACES[:1]:
        fault = _raise_interface(interface) if not _is_up(interface) else ""
        if fault:
            print(f"gnss-hil vcan up: {interface}: {fault}", file=sys.stderr)
            return MISSING
        print(f"{interface} is up")
    return 0


def _may_change_interfaces() -> bool:
    lines = Path("/proc/self/status").read_text().splitlines()
    return bool(next(int(x.split()[1], 16) for x in lines if x.startswith("CapEff:")) >> _CAP_NET_ADMIN & 1)


def _is_up(interface: str) -> bool:
    """Whether there is such an interface, and it is up (IFF_UP)."""
    try:
        return bool(int((_INTERFACES / interface / "flags").read_text(), 16) & 1)
    except OSError:
        return False


def _raise_interface(interface: str) -> str:
    """'' or why it cannot be."""
    if not _may_change_interfaces():
        return f"needs root (sudo gnss-hil vcan up {interface}); without it: gnss-hil vcan shell -- COMMAND"
    if _run("ip", "link", "show", interface):
        _run("modprobe", "vcan")  # built into some kernels: only the next line tells
        fault = _run("ip", "link", "add", interface, "type", "vcan")
        if fault:
            return f"this kernel gives no virtual CAN ({fault}); try `gnss-hil vcan shell -- COMMAND`"
    return _run("ip", "link", "set", interface, "up")


def _run(*command: str) -> str:
    """'' if the command succeeded, else the first line of its complaint."""
    program = which(command[0])
    if program is None:
        return f"{command[0]}: not installed"
    done = subprocess.run([program, *command[1:]], capture_output=True, text=True)
    if done.returncode == 0:
        return ""
    return (done.stderr.strip() or f"{command[0]} ended with status {done.returncode}").splitlines()[0]
