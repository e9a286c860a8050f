"""The embedded bus, client side: a UNIX stream of `struct can_frame`, 16 bytes each.

The wire is what a CAN_RAW socket reads and writes, so a C program joins with connect(), read(16) and
write(16). The other end is `gnss_hil.dbc.bus.hub.Hub`. A client that only writes should shutdown(SHUT_RD):
the bus is lossless, so a client that does not read holds all others back.
"""

from __future__ import annotations

import errno
import os
import select
import socket
import struct
import time
from pathlib import Path

from gnss_hil.dbc.bus.base import LinkClosed, LinkError, NotYet, frames_from_wire
from gnss_hil.dbc.contract.frames import CAN_FRAME, EMPTY, FrameBatch, to_wire

FRAME = CAN_FRAME.itemsize
CHUNK = 1 << 16

SUN_PATH_BYTES = 107
"""Longest path of a UNIX socket: struct sockaddr_un.sun_path, less the closing zero."""

_GONE = (BrokenPipeError, ConnectionResetError)


def connect(path: str) -> EmbeddedLink:
    """A link to the hub listening at `path`; LinkError if there is none, or if it is another user's."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.connect(path)
    except OSError as error:
        sock.close()
        reason = error.strerror or str(error)
        may_come = error.errno in (errno.ENOENT, errno.ECONNREFUSED) and Path(path).parent.is_dir()
        raise (NotYet if may_come else LinkError)(
            f"bus 'embedded:{path}': {reason} (no bench is running there)"
        ) from None
    owner = credentials(sock)[1]
    if owner != os.getuid():
        sock.close()
        raise LinkError(f"bus 'embedded:{path}': user {owner} serves it, not you (user {os.getuid()})")
    return EmbeddedLink(sock)


def credentials(sock: socket.socket) -> tuple[int, int]:
    """Process and user at the other end of a connected socket: who connected, or who listens."""
    process, user, _ = struct.unpack("=3i", sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
    return process, user


class EmbeddedLink:
    """A `Link` over a connected stream socket."""

    def __init__(self, sock: socket.socket):
        sock.setblocking(False)
        self._sock = sock
        self._readable = select.poll()
        self._readable.register(sock, select.POLLIN)
        self._both = select.poll()
        self._both.register(sock, select.POLLIN | select.POLLOUT)
        self._pending = bytearray()
        self._ended = False
        self._closed = False
        self._malformed = 0

    @property
    def dropped(self) -> int:
        return self._malformed

    def send(self, frames: FrameBatch) -> None:
        self.send_wire(to_wire(frames))

    def send_wire(self, wire: bytes, timeout_s: float | None = None) -> None:
        """All bytes, or TimeoutError if nothing of them could leave in time.

        Reads while it cannot write: two nodes that send much at once do not lock each other up.
        """
        rest = memoryview(wire)
        while rest:
            if self._closed:
                raise LinkClosed("this link was closed")
            try:
                rest = rest[self._sock.send(rest) :]
            except BlockingIOError:
                whole = timeout_s is not None and len(rest) == len(wire)
                if not self._wait_to_send(timeout_s if whole else None):
                    raise TimeoutError("the bus holds this sender back") from None
            except _GONE:
                raise LinkClosed("the hub closed the bus") from None

    def _wait_to_send(self, timeout_s: float | None) -> bool:
        ready = self._both.poll(None if timeout_s is None else _milliseconds(timeout_s))
        if any(event & select.POLLIN for _, event in ready) and not self._read():
            raise LinkClosed("the hub closed the bus")
        return bool(ready)

    def receive(self, timeout_s: float) -> FrameBatch:
        if self._closed:
            raise LinkClosed("this link was closed")
        deadline = None
        while True:
            frames = self._take()
            if len(frames):
                return frames
            if self._ended:
                raise LinkClosed("the hub closed the bus")
            if timeout_s > 0:
                now = time.monotonic()
                deadline = now + timeout_s if deadline is None else deadline
                if not self._readable.poll(_milliseconds(deadline - now)):
                    return EMPTY
            if not self._read() and timeout_s <= 0:
                return self._take()

    def _read(self) -> bool:
        """Moves what the socket holds to `_pending`; False if that was nothing."""
        try:
            wire = self._sock.recv(CHUNK)
        except BlockingIOError:
            return False
        except ConnectionResetError:
            wire = b""
        self._ended = not wire
        self._pending += wire
        return bool(wire)

    def _take(self) -> FrameBatch:
        whole = len(self._pending) // FRAME * FRAME
        if not whole:
            return EMPTY
        wire = bytes(self._pending[:whole])
        del self._pending[:whole]
        frames, malformed = frames_from_wire(wire)
        self._malformed += malformed
        return frames

    def fileno(self) -> int:
        return self._sock.fileno()

    def close(self) -> None:
        self._closed = True
        self._sock.close()


def _milliseconds(seconds: float) -> int:
    """poll()'s timeout: rounded up, never negative (that would wait for ever)."""
    return max(0, int(seconds * 1000 + 0.999))
