"""A kernel CAN interface (vcan0, can0) through a raw socket, in batches.

vcan has no back-pressure: a frame that finds a receiver's buffer full is lost. So the buffer is made large
and read back, the kernel's count of what it had to drop is reported, and bursts can be paced to bit time.
"""

from __future__ import annotations

import errno
import select
import socket
import struct
import time

from gnss_hil.dbc.bus.base import LinkClosed, LinkError, frames_from_wire
from gnss_hil.dbc.bus.mmsg import FRAME, Messages
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, to_wire
from gnss_hil.dbc.contract.messages import BIT_RATE

RECEIVE_BUFFER_BYTES = 16 << 20
"""Asked for; the kernel doubles it. A classical frame occupies 768 bytes of it (skb truesize)."""

_SO_RCVBUFFORCE = 33
_SO_MEMINFO = 55
_SK_MEMINFO_DROPS = 8  # index in the nine u32 of <linux/sock_diag.h>
_CAN_RAW_ERR_FILTER = 2  # <linux/can/raw.h>; Python's socket module does not name it
_CAN_ERR_MASK = 0x1FFF_FFFF

_FRAME_S = 135 / BIT_RATE
"""Longest 8-byte base frame: 111 bits and 24 stuff bits."""
_BURST = 64

_NO_ROOM = (errno.ENOBUFS, errno.EAGAIN)
_GONE = (errno.ENETDOWN, errno.ENODEV, errno.ENXIO)


def connect(channel: str) -> SocketCanLink:
    """A link to interface `channel`; "vcan0,paced" spreads its bursts over the time they take on a real
    1 Mbit/s bus. LinkError if the kernel has no such interface."""
    interface, _, option = channel.partition(",")
    if option not in ("", "paced"):
        raise LinkError(f"bus 'socketcan:{channel}': '{option}' is not an option; allowed is 'paced'")
    try:
        sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except OSError:
        raise LinkError(
            f"bus 'socketcan:{channel}': this kernel has no CAN; try `gnss-hil vcan up`, "
            "or `gnss-hil vcan shell -- COMMAND`"
        ) from None
    try:
        _prepare(sock, interface)
    except OSError as error:
        sock.close()
        missing = error.errno in (errno.ENODEV, errno.EINVAL)
        reason = f"no such CAN interface '{interface}'" if missing else error.strerror or str(error)
        if error.errno == errno.ENETDOWN:
            reason = f"CAN interface '{interface}' is down (ip link set {interface} up)"
        raise LinkError(f"bus 'socketcan:{channel}': {reason}") from None
    return SocketCanLink(sock, paced=bool(option))


def _prepare(sock: socket.socket, interface: str) -> None:
    """Binds, hears error frames, takes the largest receive buffer the kernel gives."""
    try:
        sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
    except PermissionError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    sock.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _CAN_ERR_MASK)
    sock.bind((interface,))
    if pending := sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
        raise OSError(pending, "")
    sock.setblocking(False)


class SocketCanLink:
    """A `Link` over a bound CAN_RAW socket.

    receive_buffer_bytes  what the kernel granted
    """

    def __init__(self, sock: socket.socket, paced: bool = False):
        self._sock = sock
        self._paced = paced
        self._out = Messages(sock.fileno())
        self._in = Messages(sock.fileno())
        self._readable = select.poll()
        self._readable.register(sock, select.POLLIN)
        self._malformed = 0
        self._dropped = 0
        self._closed = False
        self.receive_buffer_bytes = sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)

    @property
    def dropped(self) -> int:
        if not self._closed:
            info = self._sock.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, 36)
            self._dropped = struct.unpack("=9I", info)[_SK_MEMINFO_DROPS]
        return self._dropped + self._malformed

    def send(self, frames: FrameBatch) -> None:
        wire = memoryview(to_wire(frames))
        if not self._paced:
            self._send_all(wire)
            return
        begun_s = time.monotonic()
        for start in range(0, len(wire), _BURST * FRAME):
            ahead_s = begun_s + start // FRAME * _FRAME_S - time.monotonic()
            time.sleep(max(0.0, ahead_s))
            self._send_all(wire[start : start + _BURST * FRAME])

    def _send_all(self, wire: memoryview) -> None:
        """Waits and tries again while the interface's queue is full (ENOBUFS: poll does not tell)."""
        while wire:
            self._check()
            try:
                wire = wire[self._out.send(wire) :]
            except OSError as error:
                if error.errno not in _NO_ROOM:
                    raise self._explained(error) from None
                time.sleep(_BURST * _FRAME_S / 8)

    def receive(self, timeout_s: float) -> FrameBatch:
        self._check()
        if timeout_s > 0 and not self._readable.poll(int(timeout_s * 1000 + 0.999)):
            return EMPTY
        try:
            wire = self._in.receive()
        except OSError as error:
            if error.errno == errno.EAGAIN:
                return EMPTY
            raise self._explained(error) from None
        frames, malformed = frames_from_wire(wire)
        self._malformed += malformed
        return frames

    def fileno(self) -> int:
        return self._sock.fileno()

    def close(self) -> None:
        if not self._closed:
            self._dropped = self.dropped - self._malformed
            self._closed = True
            self._sock.close()

    def _check(self) -> None:
        if self._closed:
            raise LinkClosed("this link was closed")

    def _explained(self, error: OSError) -> Exception:
        if error.errno in _GONE:
            return LinkClosed(f"the CAN interface went away: {error.strerror}")
        return error
