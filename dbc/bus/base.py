"""What every way onto a bus has in common.

A link carries `FrameBatch`es: all frames of a `send` leave in order, a `receive` returns what has
arrived, in bus order, never the link's own frames. Times are zero on reception: a bus carries no clock
but the frames' own.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gnss_hil.dbc.contract.frames import WIDTH, FrameBatch, from_wire


class LinkError(Exception):
    """The environment cannot give this bus; one line for people."""


class UnknownBus(LinkError):
    """A specification that names no way onto a bus: the mistake is in what was asked for."""


class NotYet(LinkError):
    """No bench serves this bus, and one may at any time."""


class LinkClosed(Exception):
    """The bus went away: hub gone, interface down, link closed."""


class Link(Protocol):
    """One node's place on a bus."""

    @property
    def dropped(self) -> int:
        """Frames known to be lost on the way to this node."""
        ...

    def send(self, frames: FrameBatch) -> None:
        """All frames in order; waits while the bus holds the sender back. LinkClosed if it is gone."""

    def receive(self, timeout_s: float) -> FrameBatch:
        """At least one frame, or EMPTY after `timeout_s` (0: what is here). LinkClosed if it is gone."""
        ...

    def fileno(self) -> int:
        """What poll() tells arrivals of, for who waits on several buses; -1: there is none. What `receive(0)`
        has not handed over yet may be here already."""
        ...

    def close(self) -> None:
        """Leaves the bus; may be called twice."""


def frames_from_wire(wire: bytes) -> tuple[FrameBatch, int]:
    """Frames of concatenated `struct can_frame`, and how many were no CAN frame (length above 8).

    Bytes beyond a frame's length are whatever the sender's memory held; they come back as zero.
    """
    frames = from_wire(wire)
    if frames.length.min(initial=WIDTH) == WIDTH == frames.length.max(initial=WIDTH):
        return frames, 0
    sound = frames.length <= WIDTH
    malformed = len(frames) - int(sound.sum())
    frames = frames[sound]
    used = np.arange(WIDTH) < frames.length[:, None]
    return FrameBatch(frames.t_ns, frames.can_id, frames.length, frames.data * used), malformed
