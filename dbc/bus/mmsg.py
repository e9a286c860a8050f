"""Many datagrams in one system call: sendmmsg(2), recvmmsg(2) on a socket of 16-byte CAN frames.

A system call costs 38 us inside user-mode Linux, so a block of 300 frames sent one by one takes longer than
many an epoch. The C library's structures are laid out by ctypes, for whatever machine this is.
"""

from __future__ import annotations

import ctypes
import os

from gnss_hil.dbc.contract.frames import CAN_FRAME

FRAME = CAN_FRAME.itemsize
BATCH = 1024
"""Most messages one call takes (UIO_MAXIOV)."""

_MSG_DONTWAIT = 0x40


class _Iovec(ctypes.Structure):
    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _Msghdr(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("iov", ctypes.POINTER(_Iovec)),
        ("iov_count", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Mmsghdr(ctypes.Structure):
    _fields_ = (("header", _Msghdr), ("received", ctypes.c_uint))


_libc = ctypes.CDLL(None, use_errno=True)


class Messages:
    """A fixed array of message headers over one buffer of `BATCH` frames."""

    def __init__(self, sock_fd: int):
        self._fd = sock_fd
        self._buffer = ctypes.create_string_buffer(BATCH * FRAME)
        self._view = memoryview(self._buffer).cast("B")
        start = ctypes.addressof(self._buffer)
        self._iovecs = (_Iovec * BATCH)(*((start + i * FRAME, FRAME) for i in range(BATCH)))
        self._headers = (_Mmsghdr * BATCH)()
        for header, iovec in zip(self._headers, self._iovecs, strict=True):
            header.header.iov = ctypes.pointer(iovec)
            header.header.iov_count = 1

    def send(self, wire: memoryview) -> int:
        """Sends frames without waiting, `BATCH` at most; bytes that left. OSError as send(2)."""
        count = min(len(wire) // FRAME, BATCH)
        self._view[: count * FRAME] = wire[: count * FRAME]
        return FRAME * self._call(_libc.sendmmsg, count)

    def receive(self) -> bytes:
        """The frames that are here, `BATCH` at most, without waiting. OSError as recv(2)."""
        return bytes(self._view[: FRAME * self._call(_libc.recvmmsg, BATCH, None)])

    def _call(self, function, count: int, *more) -> int:
        done = function(self._fd, self._headers, count, _MSG_DONTWAIT, *more)
        if done < 0:
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number))
        return done
