"""Any python-can interface as a link, and python-can messages as frames."""

from __future__ import annotations

import logging
from collections.abc import Iterable

import can
import numpy as np

from gnss_hil.dbc.bus.base import LinkClosed, LinkError, UnknownBus
from gnss_hil.dbc.common.near import did_you_mean
from gnss_hil.dbc.contract.frames import EFF_FLAG, EFF_MASK, EMPTY, ERR_FLAG, RTR_FLAG, WIDTH, FrameBatch

OWN = ("embedded", "python-can")
"""What a specification may begin with besides an interface of python-can."""

DRAIN = 4096
"""Frames taken in one `receive` at most: a bus that never falls silent still lets its node work."""


def connect(interface: str, channel: str) -> PythonCanLink:
    """A link over `can.Bus`; interface "python-can" means: as python-can's configuration says."""
    name = f"{interface}:{channel}" if channel else interface
    known = sorted({*OWN, *can.VALID_INTERFACES})
    if interface not in known:
        raise UnknownBus(f"bus '{name}': no interface '{interface}'; {did_you_mean(interface, known)}")
    try:
        if interface == "python-can":
            return PythonCanLink(can.Bus(config_context=channel or None))
        return PythonCanLink(can.Bus(interface=interface, channel=channel))
    except (can.CanError, OSError, ImportError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise LinkError(f"bus '{name}': {reason}") from None


def to_messages(frames: FrameBatch) -> list[can.Message]:
    """python-can messages of frames."""
    return [
        can.Message(
            arbitration_id=can_id & EFF_MASK,
            is_extended_id=bool(can_id & EFF_FLAG),
            is_remote_frame=bool(can_id & RTR_FLAG),
            is_error_frame=bool(can_id & ERR_FLAG),
            dlc=length,
            data=None if can_id & RTR_FLAG else data[:length],
        )
        for can_id, length, data in zip(
            frames.can_id.tolist(), frames.length.tolist(), map(bytes, frames.data), strict=True
        )
    ]


def from_messages(messages: Iterable[can.Message]) -> FrameBatch:
    """Frames of classical python-can messages."""
    messages = list(messages)
    can_id = [
        m.arbitration_id
        | (EFF_FLAG if m.is_extended_id else 0)
        | (RTR_FLAG if m.is_remote_frame else 0)
        | (ERR_FLAG if m.is_error_frame else 0)
        for m in messages
    ]
    data = b"".join(bytes(m.data)[:WIDTH].ljust(WIDTH, b"\0") for m in messages)
    return FrameBatch(
        np.zeros(len(messages), np.int64),
        np.array(can_id, np.uint32),
        np.array([m.dlc for m in messages], np.uint8),
        np.frombuffer(data, np.uint8).reshape(-1, WIDTH).copy(),
    )


class PythonCanLink:
    """A `Link` over a python-can bus. CAN FD frames, which this contract has none of, count as dropped."""

    def __init__(self, bus: can.BusABC):
        self._bus = bus
        self._closed = False
        self._too_long = 0

    @property
    def dropped(self) -> int:
        return self._too_long

    def send(self, frames: FrameBatch) -> None:
        self._check()
        try:
            for message in to_messages(frames):
                self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise LinkClosed(f"the bus refused a frame: {error}") from None

    def receive(self, timeout_s: float) -> FrameBatch:
        self._check()
        messages: list[can.Message] = []
        try:
            message = self._bus.recv(max(0.0, timeout_s))
            while message is not None:
                messages.append(message)
                message = self._bus.recv(0.0) if len(messages) < DRAIN else None
        except (can.CanError, OSError) as error:
            if not messages:
                raise LinkClosed(f"the bus is gone: {error}") from None
        if not messages:
            return EMPTY
        classical = [m for m in messages if not m.is_fd]
        self._too_long += len(messages) - len(classical)
        return from_messages(classical)

    def fileno(self) -> int:
        return -1  # some interfaces have none, and others read ahead of theirs

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            self._bus.shutdown()

    def _check(self) -> None:
        if self._closed:
            raise LinkClosed("this link was closed")


logging.getLogger("can").addHandler(logging.NullHandler())
