"""The embedded bus as a python-can interface: `can.Bus(interface="gnss-hil", channel="/path.sock")`.

Registered under the entry point group `can.interface`, so every python-can tool can join:
`python -m can.logger -i gnss-hil -c /path.sock`.
"""

from __future__ import annotations

import time
from collections import deque

import can

from gnss_hil.dbc.bus.base import LinkClosed, LinkError
from gnss_hil.dbc.bus.embedded import connect
from gnss_hil.dbc.bus.pythoncan import from_messages, to_messages
from gnss_hil.dbc.contract.frames import to_wire


class EmbeddedBus(can.BusABC):
    """python-can's face of `EmbeddedLink`. It reads ahead, so it offers no file descriptor to wait on:
    python-can's Notifier then uses a thread."""

    def __init__(self, channel: str, can_filters=None, **kwargs):
        self._messages: deque[can.Message] = deque()
        try:
            self._link = connect(channel)
        except LinkError as error:
            self._is_shutdown = True  # nothing was opened: python-can's destructor has nothing to complain of
            raise can.CanInitializationError(str(error)) from None
        self.channel_info = f"gnss-hil embedded bus {channel}"
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if msg.is_fd:
            raise can.CanOperationError("the embedded bus carries classical frames only")
        try:
            self._link.send_wire(to_wire(from_messages([msg])), timeout)
        except (LinkClosed, TimeoutError) as error:
            raise can.CanOperationError(str(error)) from None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            while not self._messages:
                frames = self._link.receive(3600.0 if timeout is None else timeout)
                now_s = time.time()
                for message in to_messages(frames):
                    message.timestamp = now_s
                    self._messages.append(message)
                if timeout is not None:
                    break
        except LinkClosed as error:
            raise can.CanOperationError(str(error)) from None
        return (self._messages.popleft() if self._messages else None), False

    def shutdown(self) -> None:
        super().shutdown()
        self._link.close()
