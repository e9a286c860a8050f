"""The supervisor's rounds: record what is heard, notice who died, end a run when it is over."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from gnss_hil.dbc.bus import hub
from gnss_hil.tools.common.errors import Failed
from gnss_hil.tools.live.display import Display
from gnss_hil.tools.processes.bus_session import BusSession
from gnss_hil.tools.processes.children import LEAVE_S, Child, StatusReader
from gnss_hil.tools.processes.outcome import Outcome
from gnss_hil.tools.recording.account import Counted

TURN_S = 0.03
"""Rhythm of the supervisor: how long frames may wait to be recorded."""

NO_ANSWER = (
    "the flight software does not answer BENCH_SYNC, every epoch waits for it in vain; use --pace realtime"
)

EARLY_LEAVE_S = 1.0
"""At the end of a run the flight software may be gone this much before the emulator."""

HELD_BACK_S = 5.0
"""A bus of ours loses nothing: a peer that never reads stops it, and is named after this long."""

SETTLE_S = 1.0
"""Where no BENCH_END ends the run, the last answers may come this long after the emulator left."""

SILENCE_S = 2.0
"""An emulator that played all epochs and is silent so long has no more to say."""


@dataclass(frozen=True, slots=True)
class Figures:
    """What the master of time, or its watcher, counted; as in `Outcome`."""

    epochs: int
    unanswered: int
    wall_s: float | None
    latency_p50_s: float | None
    latency_p99_s: float | None
    latency_histogram: tuple[tuple[float, int], ...]
    mark_late_s: float | None = None


class Master(Protocol):
    """The emulator's side of a run.

    reports  it tells itself what it played;  waiting  for whom, while it does
    """

    @property
    def reports(self) -> bool: ...

    @property
    def waiting(self) -> str: ...

    @property
    def children(self) -> Sequence[Child]:
        """Its processes, as far as we started them."""
        ...

    def look(self) -> None:
        """Called every round."""

    @property
    def over(self) -> bool:
        """Whether the run is over by its own account; the processes may still be there."""
        ...

    @property
    def trouble(self) -> str:
        """What is wrong with it though no process died."""
        ...

    def figures(self) -> Figures:
        """What was counted up to now."""
        ...


class ReportingMaster:
    """Our emulator: it reports, and the run is over when it leaves."""

    reports = True
    trouble = ""

    def __init__(self, child: Child, status: StatusReader):
        self.children = [child]
        self._status = status

    @property
    def waiting(self) -> str:
        """For whom it waits at the start barrier, and what is wrong; "" if it does not, or not long yet."""
        last = self._status.last
        return last.get("waiting", "") if last.get("event") == "waiting" else ""

    def look(self) -> None:
        self._status.poll()

    @property
    def over(self) -> bool:
        return not self.children[0].running

    def figures(self) -> Figures:
        status = self._status.last
        latency = status.get("epoch_latency_ms", {})

        def seconds(name: str) -> float | None:
            return None if latency.get(name) is None else latency[name] / 1e3

        epochs, unanswered = (status.get(key, 0) for key in ("epoch", "epochs_unanswered"))
        histogram = tuple((edge_ms, count) for edge_ms, count in status.get("latency_histogram", ()))
        late_ms = status.get("mark_late_ms")
        return Figures(
            epochs,
            unanswered,
            status.get("wall_s"),
            seconds("p50"),
            seconds("p99"),
            histogram,
            None if late_ms is None else late_ms / 1e3,
        )


class WatchedMaster:
    """Another's emulator, which is followed on the bus. The run is over with its process, with BENCH_END,
    or when the scenario's time is up on the bus.

    wait_s    for the first time mark, None: for ever
    refusal   of the first time mark [ns]: why such a run cannot be judged as was asked for, "" if it can
    """

    reports = False
    waiting = ""

    def __init__(
        self,
        children: Sequence[Child],
        sessions: Sequence[BusSession],
        epochs: int,
        refusal: Callable[[int], str] | None = None,
        wait_s: float | None = None,
    ):
        self._wait_s = wait_s
        self._refusal, self._refused = refusal, ""
        self.children = children
        self._sessions = sessions
        self._epochs = epochs
        self._begun_s = time.monotonic()

    def look(self) -> None:
        """When it is played is known by its first time mark alone: what does not fit that ends it there."""
        mark_ns = self._sessions[0].first_mark_ns
        if self._refusal is not None and mark_ns >= 0:
            self._refused, self._refusal = self._refusal(mark_ns), None

    @property
    def over(self) -> bool:
        gone = bool(self.children) and not any(child.running for child in self.children)
        return gone or all(self._played(session) for session in self._sessions)

    def _played(self, session: BusSession) -> bool:
        silent = session.silent_s >= SILENCE_S
        return (
            session.sequencer.ended or session.over or (silent and session.sequencer.opened >= self._epochs)
        )

    @property
    def trouble(self) -> str:
        """One that is played at another time, or that is awaited and has not sent a time mark."""
        if self._refused:
            return self._refused
        if self._wait_s is not None and time.monotonic() - self._begun_s > self._wait_s:
            names = [child.name for child in self.children] or ["emulator"] * len(self._sessions)
            for name, session in zip(names, self._sessions, strict=True):
                if not session.sequencer.opened:
                    return f"{name}: no time mark within {self._wait_s:g} s"
        return ""

    def figures(self) -> Figures:
        latency = self._sessions[0].latency
        return Figures(
            max(session.epochs for session in self._sessions),
            sum(session.sequencer.unanswered for session in self._sessions),
            max(session.wall_s for session in self._sessions),
            latency.percentile_s(50),
            latency.percentile_s(99),
            latency.histogram(),
        )


@dataclass(slots=True, eq=False)
class Supervision:
    """The supervisor's rounds."""

    sessions: Sequence[BusSession]
    display: Display
    master: Master
    flights: Sequence[Child]
    lockstep: bool
    advised: bool = False
    named: set[tuple[int, int]] = field(default_factory=set)
    told_waiting: str = ""
    told_dropped: dict[int, int] = field(default_factory=dict)
    begun: float = field(default_factory=time.perf_counter)

    def until_over(self, stop: Callable[[], bool]) -> str:
        """Rounds until all have left; why the run broke off, "" if it did not.

        A run that never began is an error: of the process that refused, by its last line, else of the first
        to end by itself. A process that we ended is to blame for nothing.
        """
        failure = ""
        while not failure and not stop() and not self.master.over:
            self.round()
            failure = self._trouble()
        if not failure and not stop():
            failure = self._end(stop)
        for child in (*self.master.children, *self.flights):
            child.leave()
        for session in self.sessions:
            session.finish()
        self.master.look()
        if not self._epochs and not stop():
            self._refuse(failure)
        return failure

    def _end(self, stop: Callable[[], bool]) -> str:
        """The regular end: emulators leave, then the flight software; who did not end well."""
        for child in self.master.children:
            if self._leaves(child, LEAVE_S, stop) and child.process.returncode:
                return child.how_it_ended()
        heard_end = all(session.sequencer.ended for session in self.sessions)
        if not heard_end:
            self._rounds_until(lambda: False, SETTLE_S, stop)
        for flight in self.flights if heard_end else ():
            if self._leaves(flight, LEAVE_S, stop) and flight.process.returncode:
                return flight.how_it_ended()
        return ""

    def _leaves(self, child: Child, seconds: float, stop: Callable[[], bool]) -> bool:
        """Give a process time to leave by itself, recording meanwhile; whether it did."""
        self._rounds_until(lambda: not child.running, seconds, stop)
        return not child.running

    def _rounds_until(self, reached: Callable[[], bool], seconds: float, stop: Callable[[], bool]) -> None:
        until_s = time.monotonic() + seconds
        while not reached() and not stop() and time.monotonic() < until_s:
            self.round()

    def _refuse(self, failure: str) -> None:
        """The error of a run without an epoch."""
        by_themselves = [c for c in (*self.master.children, *self.flights) if not c.sent_away]
        refused = next((c for c in by_themselves if c.process.returncode in (2, 3)), None)
        if refused:
            raise refused.refusal()
        if failure or by_themselves:
            raise Failed(failure or by_themselves[0].how_it_ended())

    def _trouble(self) -> str:
        """Who broke off while the run goes on."""
        for session in self.sessions:
            if session.tap.failure:
                return session.tap.failure
        for child in self.master.children:
            if not child.running and child.process.returncode:
                return child.how_it_ended()
        for flight in self.flights:
            if not flight.running and (flight.process.returncode or not self._ends_well()):
                return flight.how_it_ended()
        return self.master.trouble

    def _ends_well(self) -> bool:
        """Whether the run is over within the time by which the flight software may leave before it."""
        self._rounds_until(lambda: self.master.over, EARLY_LEAVE_S, lambda: False)
        return self.master.over and not any(c.process.returncode for c in self.master.children)

    def round(self) -> None:
        time.sleep(TURN_S)
        for session in self.sessions:
            session.take()
            self._name_holding_back(session)
        self.master.look()
        if self.master.waiting not in ("", self.told_waiting):
            self.told_waiting = self.master.waiting
            self.display.note(self.told_waiting)
        figures = self.master.figures()
        self._advise(figures)
        self.display.refresh(figures.unanswered)

    def _name_holding_back(self, session: BusSession) -> None:
        """Once each: peers for whom the whole bus waits."""
        for number, process in session.tap.holding_back(HELD_BACK_S):
            if (session.number, number) not in self.named:
                self.named.add((session.number, number))
                self.display.note(
                    f"the bus has waited {HELD_BACK_S:g} s for peer {number} (process {process}) to read; "
                    "a peer that only sends shuts its reading side"
                )

        for number, process in session.tap.dropped[self.told_dropped.get(session.number, 0) :]:
            self.told_dropped[session.number] = self.told_dropped.get(session.number, 0) + 1
            self.display.note(
                f"peer {number} (process {process}) did not read for {hub.HELD_BACK_S:g} s: dropped"
            )

    def _advise(self, figures: Figures) -> None:
        """Once, when lockstep goes on without a single answer: it looks hung, and is not."""
        if self.lockstep and not self.advised and 0 < figures.epochs == figures.unanswered:
            self.advised = True
            self.display.note(NO_ANSWER)

    @property
    def _epochs(self) -> int:
        """Epochs on record."""
        return self.sessions[0].epochs

    def _counted(self) -> tuple[Counted, ...]:
        """What the sides counted themselves, by craft."""
        epochs = self.master.figures().epochs if self.master.reports else None
        flown = [flight.status and flight.status.last.get("fixes") for flight in self.flights]
        flown += [None] * (len(self.sessions) - len(flown))
        return tuple(Counted(epochs, fixes) for fixes in flown)

    def outcome(self, failure: str, interrupted: bool) -> Outcome:
        figures = self.master.figures()
        for flight in self.flights:
            if flight.status is not None:
                flight.status.poll()
        return Outcome(
            epochs=self._epochs,
            unanswered=figures.unanswered,
            wall_s=figures.wall_s or time.perf_counter() - self.begun,
            latency_p50_s=figures.latency_p50_s,
            latency_p99_s=figures.latency_p99_s,
            frames_sent=sum(session.sequencer.declared for session in self.sessions) or None,
            interrupted=interrupted,
            failure=failure,
            latency_histogram=figures.latency_histogram,
            mark_late_s=figures.mark_late_s,
            heard=tuple(session.account for session in self.sessions),
            counted=self._counted(),
        )
