"""One connection of a hub: what waits to leave it, and a frame that has not come whole."""

from __future__ import annotations

import math
import selectors
import socket
from collections import deque
from dataclasses import dataclass, field


@dataclass(eq=False, slots=True)
class Peer:
    """One connection. `tail` is the beginning of a frame that has not come whole; `queue` waits to leave;
    `full_s` is when it began to hold the others back."""

    number: int
    sock: socket.socket
    tail: bytes = b""
    queue: deque[memoryview] = field(default_factory=deque)
    queued: int = 0
    deaf: bool = False
    interest: int = selectors.EVENT_READ
    process: int = 0
    full_s: float = math.inf

    def offer(self, wire: bytes) -> None:
        """Sends whole frames, or puts them behind what waits."""
        if self.deaf:
            return
        self.queue.append(memoryview(wire))
        self.queued += len(wire)
        if len(self.queue) == 1:
            self.flush()

    def flush(self) -> None:
        """Sends what the socket takes. A peer that shut its reading side stays as a sender."""
        try:
            while self.queue:
                sent = self.sock.send(self.queue[0])
                self.queued -= sent
                if sent < len(self.queue[0]):
                    self.queue[0] = self.queue[0][sent:]
                else:
                    self.queue.popleft()
        except BlockingIOError:
            pass
        except OSError:
            self.deaf = True
            self.queue.clear()
            self.queued = 0
