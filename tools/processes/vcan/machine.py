"""What user-mode Linux asks of this machine: programs, modules, a place for its memory."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from gnss_hil.tools.processes.vcan import wide_registers

MISSING = 3
"""Exit status where this machine has not what is needed."""

_MODULE_ROOT = Path("/usr/lib/uml/modules")

SYSTEM_PATH = "/usr/local/sbin:/usr/sbin:/sbin"
"""Folders of programs that a plain user's PATH may be without."""

_PACKAGES = {
    "linux.uml": "user-mode-linux",
    "insmod": "kmod",
    "ip": "iproute2",
    "setsid": "util-linux",
    "stty": "coreutils",
}
"""Programs that the guest needs, and the Debian packages they come in."""

MEMORY_BYTES = 2 << 30
"""Of the kernel; pages come into being as they are touched."""

MEMORY_FOLDERS = ("/dev/shm", "/tmp", "/var/tmp")
"""Where the kernel's memory may lie, best first: on a tmpfs it costs no disk."""


def lacking(memory_bytes: int = MEMORY_BYTES) -> str:
    """'' or what user-mode Linux needs and this machine has not."""
    missing = sorted({package for name, package in _PACKAGES.items() if which(name) is None})
    if missing:
        return f"needs the Debian packages {' '.join(missing)} (apt install {' '.join(missing)})"
    if not module_folder().is_dir():
        return f"no modules for this user-mode-linux in {_MODULE_ROOT} (reinstall the package)"
    if wide_registers.are_there() and wide_registers.compiler() is None:
        return wide_registers.LACKING
    rooms = _rooms()
    if not rooms:
        return (
            f"needs a writable folder that is not mounted noexec, for memory: {MEMORY_FOLDERS[0]} or TMPDIR"
        )
    if memory_folder(memory_bytes) is None:
        name, room = max(rooms.items(), key=lambda item: item[1])
        return (
            f"needs {memory_bytes >> 20}M of room for memory; the most there is: {room >> 20}M, in {name} "
            "(--mem SIZE, or TMPDIR)"
        )
    return ""


def memory_folder(memory_bytes: int) -> str | None:
    """The first folder with room for the kernel's memory: a full disk kills it in the middle of its work."""
    return next((name for name, room in _rooms().items() if room >= memory_bytes), None)


def _rooms() -> dict[str, int]:
    """Folders for the kernel's memory, which it maps as a program (in containers /dev/shm may be noexec),
    best first, and the bytes that are free there."""
    places = dict.fromkeys((MEMORY_FOLDERS[0], tempfile.gettempdir(), *MEMORY_FOLDERS[1:]))
    return {name: room for name in places if (room := _room(name)) is not None}


def _room(name: str) -> int | None:
    try:
        status = os.statvfs(name)
        if status.f_flag & os.ST_NOEXEC or not os.access(name, os.W_OK | os.X_OK):
            return None
    except OSError:
        return None
    return status.f_bavail * status.f_frsize


def which(program: str) -> str | None:
    return shutil.which(program, path=f"{os.environ.get('PATH', os.defpath)}:{SYSTEM_PATH}")


def module_folder() -> Path:
    done = subprocess.run([which("linux.uml") or "linux.uml", "--version"], capture_output=True, text=True)
    return _MODULE_ROOT / done.stdout.strip() / "kernel"
