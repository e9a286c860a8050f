"""The socket that a hub listens on: its own, and no other's."""

from __future__ import annotations

import errno
import os
import socket
from pathlib import Path

from gnss_hil.dbc.bus.base import LinkError
from gnss_hil.dbc.bus.embedded import SUN_PATH_BYTES


def mark_of(path: Path) -> tuple[int, int] | None:
    """Device and inode of what lies at a path; None if nothing does."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def listening(path: Path) -> socket.socket:
    """A socket at a path, listening, that its user alone can reach; LinkError if there can be none."""
    if len(os.fsencode(path)) > SUN_PATH_BYTES:
        raise LinkError(f"bus 'embedded:{path}': the path is longer than {SUN_PATH_BYTES} bytes")
    _clear_away(path)
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        os.fchmod(sock.fileno(), 0o600)  # before bind, so that the name never exists with another mode
        sock.bind(os.fspath(path))
        sock.listen()
    except OSError as error:
        sock.close()
        raise LinkError(f"bus 'embedded:{path}': {_refusal(path, error)}") from None
    sock.setblocking(False)
    return sock


def _refusal(path: Path, error: OSError) -> str:
    if error.errno != errno.EADDRINUSE:
        return error.strerror or str(error)
    return "another process serves it" if path.is_socket() else "something else than a socket is there"


def _clear_away(path: Path) -> None:
    """Removes the socket of a hub that died without removing it; anything else at `path` stays."""
    if not path.is_socket():
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(os.fspath(path))
        except ConnectionRefusedError:
            path.unlink(missing_ok=True)
        except OSError:
            return  # bind will say what is wrong
