"""Where the recorder's frames come from: a tap on a bus of our own, or a listener on another's."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from gnss_hil.dbc.bus.base import LinkClosed, LinkError, frames_from_wire
from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.open_link import is_shared, open_link
from gnss_hil.dbc.bus.probe import senders_heard
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.tools.common.errors import Failed

QUEUE_PIECES = 4096
"""Pieces of the bus that may wait for the recorder; then the bus waits."""


SOMEBODY = 0
"""The peer of a bus that does not know its peers; those of ours are numbered from 1."""

LISTEN_S = 1.2
"""How long a shared bus is listened to: a bench at real time speaks once a second."""


def check_bus(spec: str, codec: Codec, awaited: Collection[str] = ()) -> None:
    """LinkError if a bus cannot be joined, or another bench plays there; asked before a run folder is made.

    awaited  nodes that may be there already
    """
    link = open_link(spec)
    try:
        others = {*codec.sender_of} - {"", *awaited}
        heard = senders_heard(link, codec, others, LISTEN_S) if is_shared(spec) else set()
    except LinkClosed as error:
        raise LinkError(f"bus '{spec}': {error or 'gone'}") from None
    finally:
        link.close()
    if heard:
        raise LinkError(f"bus '{spec}': {', '.join(sorted(heard))} of another bench can be heard there")


class BusTap:
    """Frames of the bus, from another thread to the supervisor's.

    holding_back  peers (number, process) that have held the bus back for so many seconds; a bus of ours knows
    dropped       peers that never read

    Frames come out with the instant they were heard in `t_ns`: nanoseconds of `time.perf_counter_ns`.
    """

    def __init__(self):
        self._pieces: queue.Queue[tuple[int, int, FrameBatch | bytes]] = queue.Queue(QUEUE_PIECES)
        self.holding_back: Callable[[float], list[tuple[int, int]]] = lambda seconds: []
        self.dropped: list[tuple[int, int]] = []
        self.closing = False
        self.failure = ""

    def hear(self, piece: FrameBatch | bytes, peer: int = SOMEBODY) -> None:
        """Hand over a piece of a peer's; waits while the recorder is behind."""
        heard = time.perf_counter_ns(), peer, piece
        while not self.closing:
            try:
                return self._pieces.put(heard, timeout=0.1)
            except queue.Full:
                continue

    def take(self) -> list[tuple[int, FrameBatch]]:
        """All that is here, in bus order: pieces and whose they are."""
        pieces = []
        while True:
            try:
                heard_ns, peer, piece = self._pieces.get_nowait()
            except queue.Empty:
                return pieces
            frames = piece if isinstance(piece, FrameBatch) else frames_from_wire(piece)[0]
            pieces.append((peer, replace(frames, t_ns=np.full(len(frames), heard_ns))))


@contextmanager
def embedded_bus(path: Path, tap: BusTap) -> Iterator[str]:
    """A hub of our own with the recorder inside; its specification."""
    hub = Hub(path, taps=(lambda peer, wire: tap.hear(wire, peer),))
    tap.holding_back = hub.holding_back
    tap.dropped = hub.dropped
    try:
        yield f"embedded:{path}"
    finally:
        tap.closing = True
        hub.close()
        if hub.failure is not None:
            raise Failed(f"the bus failed: {hub.failure}")


@contextmanager
def foreign_bus(spec: str, tap: BusTap) -> Iterator[str]:
    """A bus that others own: the recorder is a listener of its own on it."""
    link = open_link(spec)
    ended = threading.Event()

    def listen():
        try:
            while not ended.is_set():
                frames = link.receive(0.1)
                if len(frames):
                    tap.hear(frames)
        except LinkClosed as error:
            tap.failure = f"bus {spec}: {error or 'gone'}"

    thread = threading.Thread(target=listen, name="recorder", daemon=True)
    thread.start()
    try:
        yield spec
    finally:
        ended.set()
        tap.closing = True
        thread.join()
        link.close()
