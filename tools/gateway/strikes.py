"""Faults let loose on the frames of a bus that is heard, whoever sends them."""

from __future__ import annotations

from collections.abc import Callable

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from gnss_hil.dbc.lockstep.messages import is_bench
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.emulator.faults.engine import Event, FaultPlan, fresh, inject
from gnss_hil.tools.gateway.one_frame import Reader

Arm = Callable[[int], FaultPlan]
"""Makes the faults of a run of a session."""


class Strikes:
    """The faults of a bus, run after run.

    plan     of the run at hand
    touched  frames that faults have taken out, put in or changed
    """

    def __init__(self, arm: Arm):
        self.touched = 0
        self.plan = arm(0)
        self._arm = arm
        self._state = fresh(self.plan)
        self._marked = 0, 0
        self._events: list[Event] = []

    @property
    def armed(self) -> bool:
        return bool(self.plan.armed)

    def begin(self, session: int) -> None:
        """A run begins: nothing of the one before is remembered."""
        self.plan = self._arm(session)
        self._state = fresh(self.plan)

    def marked(self, epoch: int, t_ns: int) -> None:
        """The simulated time of an epoch."""
        self._marked = epoch, t_ns

    def strike(self, frames: FrameBatch, epoch: int, direction: Direction) -> FrameBatch:
        """An epoch's frames of one direction as the faults leave them; bench frames are not struck. Where
        nothing was, the frames themselves."""
        bench = is_bench(frames.can_id)
        strays = frames[bench] if bench.any() else None
        struck = frames if strays is None else frames[~bench]
        before = struck
        marked, t_ns = self._marked
        at = At(epoch, t_ns + (epoch - marked) * self.plan.interval_ns, direction)
        self._state, struck, events = inject(self.plan, self._state, struck, at)
        self._events += events
        self.touched += sum(event.touched for event in events)
        if struck is before:
            return frames
        return struck if strays is None else concat((strays, struck))

    def take(self) -> tuple[Event, ...]:
        """What acted since the last call."""
        events, self._events = tuple(self._events), []
        return events


class Clock:
    """Reads the time that marks show."""

    def __init__(self, codec: Codec):
        self._coarse = Reader(codec, "TIME_GPS", "week", "second")
        self._fine = Reader(codec, "TIME_FINE", "nanosecond")

    def of(self, frames: FrameBatch) -> int | None:
        """GPS time [ns] that the first mark in these frames shows; None if it is not whole and intact."""
        coarse, fine = self._coarse.first(frames), self._fine.first(frames)
        return None if coarse is None or fine is None else gpstime.from_week(*coarse, *fine)
