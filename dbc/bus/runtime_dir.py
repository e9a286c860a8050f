"""The runtime directory: a private folder for a bus's socket, and the removal of what dead processes left."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

from gnss_hil.dbc.bus.embedded import SUN_PATH_BYTES

_NAME_BYTES = 16
"""Room for a socket's name in a private folder."""


@cache
def _prefix() -> str:
    """Of the folders that this kernel's processes make. Its locks say nothing of those of another kernel on
    the same files: of a user-mode Linux, or of the host under one."""
    boot = Path("/proc/sys/kernel/random/boot_id")
    return f"gnss-hil-bus-{boot.read_text()[:6] if boot.exists() else 'unknown'}-"


class RuntimeDir:
    """A folder of mode 0700 for the bus's socket, removed at the end.

    Where the temporary folder's name is so long that a socket's path would not fit, it is in /tmp. The folder
    is locked while its process lives, so the folder of one that was killed is known, and is removed by the
    next that makes one there.
    """

    def __enter__(self) -> Path:
        parent = parent_folder()
        _remove_abandoned(parent)
        while not self._make(parent):
            pass
        return self._path

    def _make(self, parent: Path) -> bool:
        """A locked folder; False if another process took it for abandoned before it was locked."""
        self._path = Path(tempfile.mkdtemp(prefix=_prefix(), dir=parent))
        try:
            self._lock = os.open(self._path, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:
            return False
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        if self._path.exists():
            return True
        os.close(self._lock)
        return False

    def __exit__(self, *_) -> None:
        shutil.rmtree(self._path, ignore_errors=True)
        os.close(self._lock)


def parent_folder() -> Path:
    """Where private folders are: the temporary folder, or /tmp if that leaves no room for a socket."""
    parent = tempfile.gettempdir()
    return Path(parent if _fits(parent) else "/tmp")


def _fits(parent: str) -> bool:
    """Whether a socket's path has room in a private folder within `parent`."""
    return len(os.fsencode(parent)) + len(f"/{_prefix()}12345678/") + _NAME_BYTES <= SUN_PATH_BYTES


def _remove_abandoned(parent: Path) -> None:
    """Removes folders of ours that no process holds a lock on."""
    for path in parent.glob(f"{_prefix()}*"):
        try:
            if path.lstat().st_uid != os.getuid():
                continue
            lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        except OSError:  # gone meanwhile, or no folder
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(path, ignore_errors=True)
        except BlockingIOError:
            pass  # its process lives
        finally:
            os.close(lock)
