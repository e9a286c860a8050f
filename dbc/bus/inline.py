"""A bus inside one process: same interface, same bytes, no socket."""

from __future__ import annotations

import threading
from collections import deque

from gnss_hil.dbc.bus.base import LinkClosed
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch, concat


class InlineBus:
    """Joins any number of links. Queues are unbounded: sender and receiver may be one thread."""

    def __init__(self):
        self._changed = threading.Condition()
        self._links: list[InlineLink] = []
        self._closed = False

    def connect(self) -> InlineLink:
        link = InlineLink(self)
        with self._changed:
            self._links.append(link)
        return link

    def close(self) -> None:
        """Ends the bus for every link."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


class InlineLink:
    """A `Link` on an `InlineBus`."""

    dropped = 0

    def __init__(self, bus: InlineBus):
        self._bus = bus
        self._queue: deque[FrameBatch] = deque()
        self._closed = False

    def send(self, frames: FrameBatch) -> None:
        if not len(frames):
            return
        with self._bus._changed:
            self._check()
            for link in self._bus._links:
                if link is not self:
                    link._queue.append(frames)
            self._bus._changed.notify_all()

    def receive(self, timeout_s: float) -> FrameBatch:
        with self._bus._changed:
            self._bus._changed.wait_for(
                lambda: self._queue or self._closed or self._bus._closed, max(0.0, timeout_s)
            )
            if not self._queue:
                self._check()
                return EMPTY
            frames = concat(self._queue)
            self._queue.clear()
            return frames

    def fileno(self) -> int:
        return -1

    def close(self) -> None:
        with self._bus._changed:
            if not self._closed:
                self._closed = True
                self._bus._links.remove(self)

    def _check(self) -> None:
        if self._closed:
            raise LinkClosed("this link was closed")
        if self._bus._closed:
            raise LinkClosed("the bus was closed")
