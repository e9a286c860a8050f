"""A gateway at work: two links, one thread, until the run ends."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from gnss_hil.dbc.bus.base import Link, LinkClosed
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.tools.gateway.crossing import Crossed, Crossing

SLICE_S = 0.1
"""Longest wait at a stretch, so that a signal is noticed."""

BACK = {Direction.FLIGHT: Direction.RECEIVERS, Direction.RECEIVERS: Direction.FLIGHT}
"""The other way: what goes to the flight software comes from the bus of the receivers."""

LOOK_S = 0.001
"""How often a link is looked at that cannot tell when frames come."""


@dataclass(slots=True)
class Passed:
    """Frames that came in and went out so far, of a direction."""

    came: int = 0
    left: int = 0


class BusGone(Exception):
    """A bus went away; the direction towards it."""

    def __init__(self, toward: Direction):
        super().__init__(toward)
        self.toward = toward


def run_gateway(
    links: Mapping[Direction, Link],
    crossing: Crossing,
    stop: Callable[[], bool],
    each: Callable[[float], None] = lambda now_s: None,
) -> dict[Direction, Passed]:
    """Passes frames until `stop()` or the run's BENCH_END; what has passed. BusGone if a bus goes away
    before.

    links  the bus that lies in each direction
    each   called after whatever has passed
    """
    passed = {way: Passed() for way in Direction}

    unseen = set(Direction)  # ways on whose bus something may be that poll() does not tell of

    def send(leaving: Iterable[Crossed]) -> None:
        for one in leaving:
            if len(one.frames):
                with _Watched(one.direction):
                    links[one.direction].send(one.frames)
                passed[one.direction].left += len(one.frames)
                unseen.add(BACK[one.direction])  # who sends may have read ahead

    def look(ways: Iterable[Direction]) -> None:
        for way in ways:
            unseen.discard(way)
            with _Watched(BACK[way]):
                frames = links[BACK[way]].receive(0)
            if not len(frames):
                continue
            passed[way].came += len(frames)
            send(crossing.hear(way, frames, time.monotonic()))

    waits = _Waits(links)
    while not crossing.ended and not stop():
        look([way for way in BACK if way in unseen])
        now_s = time.monotonic()
        send(crossing.expire(now_s))
        each(now_s)
        if not unseen and not crossing.ended:
            due_s = crossing.due_s()
            look(waits.wait(SLICE_S if due_s is None else min(max(due_s - now_s, 0.0), SLICE_S)))
    send(crossing.rest())
    return passed


class _Waits:
    """Waits for frames on any link."""

    def __init__(self, links: Mapping[Direction, Link]):
        self._poll = select.poll()
        numbered = [(link.fileno(), BACK[toward]) for toward, link in links.items()]
        self._untold = tuple(way for number, way in numbered if number < 0)
        self._ways = {number: way for number, way in numbered if number >= 0}
        for number in self._ways:
            self._poll.register(number, select.POLLIN)

    def wait(self, timeout_s: float) -> tuple[Direction, ...]:
        """Ways on which there may be something."""
        longest_s = min(timeout_s, LOOK_S) if self._untold else timeout_s
        ready = self._poll.poll(int(longest_s * 1000 + 0.999))
        return (*(self._ways[number] for number, _ in ready), *self._untold)


class _Watched:
    """Within the context LinkClosed becomes BusGone."""

    def __init__(self, toward: Direction):
        self._toward = toward

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if isinstance(error, LinkClosed):
            raise BusGone(self._toward) from None
