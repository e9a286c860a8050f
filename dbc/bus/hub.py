"""The embedded bus: one thread that passes frames between processes, in one order, losing none.

A peer is a stream of `struct can_frame`. What one sends goes to all others and to the taps, never back.
Everything passes through one thread, so all receivers and taps see the frames of all senders in the same
order. A receiver that falls behind fills its queue; then no other is read until it catches up. One that does
not for `HELD_BACK_S` is dropped: nobody waits for ever.
"""

from __future__ import annotations

import errno
import math
import selectors
import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from gnss_hil.dbc.bus.embedded import CHUNK, FRAME, credentials
from gnss_hil.dbc.bus.hub_peer import Peer
from gnss_hil.dbc.bus.hub_socket import listening, mark_of
from gnss_hil.dbc.contract.frames import WIDTH

QUEUE_BYTES = 1 << 20
"""A peer with more than this waiting for it holds the others back (65,536 frames)."""

HELD_BACK_S = 60.0
"""A peer that has held the others back for so long is dropped."""

LOOK_S = 0.2
"""While a peer holds the others back it is looked at as often."""

ACCEPT_AGAIN_S = 0.2
"""How long those who connect wait at least where a process has no file descriptor left."""

_NO_ROOM = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)

Tap = Callable[[int, bytes], None]
"""Called in the hub's thread with the sender's number and whole frames, in bus order."""

PeerWatch = Callable[[int, bool], None]
"""Called in the hub's thread with a peer's number: True it joined, False it is gone."""


class Hub:
    """Serves one bus at `path` from its own thread until closed.

    taps     see every frame, in bus order
    watch    is called with who joins and who is gone
    failure  what a tap or the watch raised; the bus was closed for it
    dropped  number and process of peers that never read
    clock    seconds, monotonic
    """

    def __init__(
        self,
        path: Path,
        taps: Sequence[Tap] = (),
        watch: PeerWatch = lambda number, here: None,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.path = Path(path)
        self.failure: BaseException | None = None
        self.malformed = 0
        self.dropped: list[tuple[int, int]] = []
        self._clock = clock
        self._taps = tuple(taps)
        self._watch = watch
        self._peers: dict[int, Peer] = {}
        self._full: set[int] = set()
        self._joined = 0
        self._listener = listening(self.path)
        self._mark = mark_of(self.path)
        self._wake, self._woken = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        self._refusing = False
        self._listen_on(self._listener)
        self._selector.register(self._woken, selectors.EVENT_READ, self)
        self._thread = threading.Thread(target=self._serve, name=f"hub {self.path.name}", daemon=True)
        self._thread.start()

    def __enter__(self) -> Hub:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    @property
    def peers(self) -> int:
        return len(self._peers)

    @property
    def joined(self) -> int:
        """How many have joined since it began."""
        return self._joined

    def holding_back(self, seconds: float) -> list[tuple[int, int]]:
        """Number and process of peers that do not read and so have held everybody back for so long."""
        since_s = self._clock() - seconds
        return [(peer.number, peer.process) for peer in list(self._peers.values()) if peer.full_s <= since_s]

    @property
    def reachable(self) -> bool:
        """Whether what lies at `path` is this hub's socket: it may be gone, or another's by now."""
        return mark_of(self.path) == self._mark

    def close(self) -> None:
        """Ends the bus: every peer reads an end of file. May be called twice."""
        with suppress(OSError):
            self._wake.send(b"x")
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _serve(self) -> None:
        try:
            while self._turn():
                pass
        except BaseException as error:  # a tap's mistake must reach the supervisor, not die with the thread
            self.failure = error
        finally:
            self._shut()

    def _turn(self) -> bool:
        refused = self._refusing
        look_s = ACCEPT_AGAIN_S if self._refusing else LOOK_S if self._full else None
        for key, events in self._selector.select(look_s):
            peer = key.data
            if peer is self:
                return False
            if peer is None:
                self._accept()
                continue
            if events & selectors.EVENT_WRITE:
                peer.flush()
                self._settle(peer)
            if events & selectors.EVENT_READ and peer.interest & selectors.EVENT_READ:
                self._read(peer)
        if refused:
            self._refuse(False)
        self._drop_deaf()
        return True

    def _drop_deaf(self) -> None:
        """Peers for whom the bus has waited long enough."""
        for number in [*self._full]:
            peer = self._peers[number]
            if self._clock() - peer.full_s >= HELD_BACK_S:
                self.dropped.append((peer.number, peer.process))
                self._drop(peer)

    def _accept(self) -> None:
        """Accepts all connections that wait."""
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError as error:  # none is waiting any more
                if error.errno in _NO_ROOM:
                    self._refuse(True)
                return
            sock.setblocking(False)
            self._joined += 1
            peer = Peer(self._joined, sock, process=credentials(sock)[0])
            self._selector.register(sock, peer.interest, peer)
            self._peers[peer.number] = peer
            self._apply_interest()
            self._watch(peer.number, True)

    def _refuse(self, refusing: bool) -> None:
        """Let those who connect wait: no file descriptor is left, and the selector would not rest."""
        if refusing != self._refusing:
            self._refusing = refusing
            (self._selector.unregister if refusing else self._listen_on)(self._listener)

    def _listen_on(self, listener: socket.socket) -> None:
        self._selector.register(listener, selectors.EVENT_READ, None)

    def _read(self, peer: Peer) -> None:
        try:
            wire = peer.sock.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError:
            wire = b""
        if not wire:
            self._drop(peer)
            return
        self._accept()  # a peer that connected before these bytes were sent must receive them
        if peer.tail:
            wire = peer.tail + wire
        whole = len(wire) // FRAME * FRAME
        if whole < len(wire):
            wire, peer.tail = wire[:whole], wire[whole:]
        else:
            peer.tail = b""
        self._forward(peer, self._sound(wire))

    def _sound(self, wire: bytes) -> bytes:
        """Without frames that claim more than eight bytes."""
        if max(wire[4::FRAME], default=0) <= WIDTH:
            return wire
        frames = [wire[i : i + FRAME] for i in range(0, len(wire), FRAME)]
        sound = [frame for frame in frames if frame[4] <= WIDTH]
        self.malformed += len(frames) - len(sound)
        return b"".join(sound)

    def _forward(self, sender: Peer, wire: bytes) -> None:
        if not wire:
            return
        for peer in self._peers.values():
            if peer is not sender:
                peer.offer(wire)
                self._settle(peer)
        for tap in self._taps:
            tap(sender.number, wire)

    def _settle(self, peer: Peer) -> None:
        """Brings the selector in line with a peer's queue."""
        full = peer.queued > QUEUE_BYTES
        if full != (peer.number in self._full):
            peer.full_s = self._clock() if full else math.inf
            (self._full.add if full else self._full.discard)(peer.number)
            self._apply_interest()
        elif bool(peer.queue) != bool(peer.interest & selectors.EVENT_WRITE):
            self._apply_interest()

    def _apply_interest(self) -> None:
        """A peer is read while no other's queue is full, and written while its own holds something."""
        for peer in self._peers.values():
            held_back = bool(self._full - {peer.number})
            interest = selectors.EVENT_WRITE if peer.queue else 0
            interest |= 0 if held_back else selectors.EVENT_READ
            if interest == peer.interest:
                continue
            if not interest:
                self._selector.unregister(peer.sock)
            elif not peer.interest:
                self._selector.register(peer.sock, interest, peer)
            else:
                self._selector.modify(peer.sock, interest, peer)
            peer.interest = interest

    def _drop(self, peer: Peer) -> None:
        if peer.interest:
            self._selector.unregister(peer.sock)
        peer.sock.close()
        self.malformed += bool(peer.tail)
        del self._peers[peer.number]
        self._full.discard(peer.number)
        self._apply_interest()
        self._watch(peer.number, False)

    def _shut(self) -> None:
        for peer in self._peers.values():
            peer.sock.close()
        self._listener.close()
        self._wake.close()
        self._woken.close()
        self._selector.close()
        if self.reachable:
            self.path.unlink(missing_ok=True)
