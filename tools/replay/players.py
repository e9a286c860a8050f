"""The three ways to play a recorded run: as the emulator, as the flight software, as a loudspeaker.

Each plays on a link until the recording ends, the run is over or `stop()`. The frames of an epoch go to
`keep(number, emulator's frames, flight software's frames)`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.dbc.lockstep.master_loop import SLICE_S, Bus, MasterLoop, MissingNodes, Tally
from gnss_hil.dbc.lockstep.slave_loop import run_slave
from gnss_hil.dbc.lockstep.slave_protocol import Slave
from gnss_hil.flightsw.io import encode
from gnss_hil.tools.common.errors import Failed
from gnss_hil.tools.decoder.block import of_frames
from gnss_hil.tools.decoder.screen import intact
from gnss_hil.tools.decoder.time_marks import marks_in, with_session
from gnss_hil.tools.replay.compare import Comparison
from gnss_hil.tools.replay.compare_fixes import FixComparison
from gnss_hil.tools.replay.recorded_run import RecordedEpoch, RecordedRun, one_bus

Keep = Callable[[int, FrameBatch, FrameBatch], None]
Stop = Callable[[], bool]


@dataclass(slots=True)
class Played:
    """How a replay went.

    comparison   what the other side sent against what it sent then
    epochs       played
    sent, heard  frames of the recorded run, frames of the other side
    wall_s       from the first epoch to the last
    complete     to the end of the recorded run, or of the run on the bus
    tally        of the master of time
    """

    comparison: Comparison | FixComparison
    epochs: int = 0
    sent: int = 0
    heard: int = 0
    wall_s: float = 0.0
    complete: bool = False
    tally: Tally = field(default_factory=Tally)

    def count(self, sent: FrameBatch, heard: FrameBatch) -> None:
        self.epochs += 1
        self.sent += len(sent)
        self.heard += len(heard)


@dataclass(frozen=True, slots=True)
class Mastery:
    """How the recorded run plays the master of time.

    pace      simulated per wall second, None for lockstep
    required  begin when a flight software of this contract was heard, at the latest after `wait_s`
    limit_s   lockstep: how long an answer may take
    session   instead of the recorded one
    by_fixes  the flight software is another's: what it makes of the frames counts, not its frames
    """

    pace: float | None
    required: bool
    wait_s: float | None
    limit_s: float
    session: int | None
    by_fixes: bool = False


def play_emulator(
    recorded: RecordedRun, link: Link, how: Mastery, keep: Keep, stop: Stop, spec: str = ""
) -> Played:
    """The recorded run as the master of time, on the bus `spec`."""
    session = how.session
    number = recorded.session if session is None else session
    master = MasterLoop(
        {recorded.bus: Bus(link, recorded.codec, spec)},
        number,
        how.pace,
        recorded.interval_ns / 1e9,
        how.limit_s,
        stop=stop,
    )
    try:
        master.assemble((FLIGHT_NODE,) if how.required else (), how.wait_s)
    except MissingNodes as error:
        raise Failed(str(error)) from None
    frames = Comparison(recorded.codec, exact=how.pace is None)
    comparison = FixComparison(recorded.codec, frames) if how.by_fixes else frames
    played = Played(comparison, tally=master.tally)
    begun_s = time.perf_counter()
    for epoch in recorded.epochs():
        if stop():
            break
        block = epoch.emulator if session is None else with_session(recorded.codec, epoch.emulator, session)
        answer = master.play(epoch.number, {recorded.bus: block})[recorded.bus]
        if len(answer) or not stop():
            played.comparison.add(epoch.number, epoch.flight, answer)
        played.count(sent=block, heard=answer)
        keep(epoch.number, block, answer)
    else:
        played.complete = True
    played.wall_s = time.perf_counter() - begun_s
    master.end(played.epochs, "COMPLETED" if played.complete else "INTERRUPTED")
    return played


def play_flight(recorded: RecordedRun, link: Link, keep: Keep, stop: Stop) -> Played:
    """The recorded run as the flight software: in each epoch that is heard it sends what it sent then."""
    played = Played(Comparison(recorded.codec, exact=True))
    seeker = _Seeker(recorded)
    begun_s: list[float] = []

    def play(block: FrameBatch, fresh: bool) -> FrameBatch:
        begun_s.append(time.perf_counter())
        number = int(marks_in(recorded.codec, block).epoch[0])
        epoch = seeker.at(number)
        played.comparison.add(number, epoch.emulator, block)
        played.count(sent=epoch.flight, heard=block)
        keep(number, block, epoch.flight)
        return epoch.flight

    progress = run_slave(link, Slave(recorded.codec), _greeting(recorded), play, stop, once=True)
    played.wall_s = time.perf_counter() - begun_s[0] if begun_s else 0.0
    played.complete = progress.runs_ended > 0
    return played


class _Seeker:
    """Epochs of a recorded run by number; going back begins it again."""

    def __init__(self, recorded: RecordedRun):
        self._recorded = recorded
        self._rest: Iterator[RecordedEpoch] = iter(())
        self._here: RecordedEpoch | None = None

    def at(self, number: int) -> RecordedEpoch:
        if self._here is None or number < self._here.number:
            self._rest, self._here = self._recorded.epochs(), None
        while self._here is None or self._here.number < number:
            last, self._here = self._here, next(self._rest, None)
            if self._here is None:
                there = f"{self._recorded.first} to {last.number}" if last else "none"
                raise Failed(f"epoch {number} is on the bus; the recording has {there}")
        if self._here.number != number:
            raise Failed(
                f"epoch {number} is on the bus; the recording has none, its next is {self._here.number}"
            )
        return self._here


def _greeting(recorded: RecordedRun) -> FrameBatch:
    """The heartbeat before the first epoch, with the recorded count of starts."""
    first = next(recorded.epochs()).flight
    beats = of_frames(recorded.codec, first[intact(recorded.codec, first, "HEARTBEAT", FLIGHT_NODE)])
    counts = beats["HEARTBEAT"]["boot_count"].tolist()
    boots = counts[0] if counts else 0
    frames = encode.heartbeat(recorded.codec, encode.NodeState.READY, boots, 0)
    return e2e.protect(recorded.codec, frames, e2e.fresh_counters(recorded.codec), 0)[0]


def play_all(recorded: RecordedRun, link: Link, pace: float, stop: Stop) -> Played:
    """Every frame of the bus as it was recorded, at its time; what others send is read and forgotten."""
    played = Played(Comparison(recorded.codec, exact=True))
    begun_s, first_us = time.monotonic(), None
    for piece in recorded.recording.pieces():
        unix_us, frames = one_bus(piece, recorded.bus)
        if not len(frames):
            continue
        first_us = int(unix_us[0]) if first_us is None else first_us
        due_s = np.maximum.accumulate((unix_us - first_us) / (1e6 * pace))
        row = 0
        while row < len(frames) and not stop():
            now_s = time.monotonic() - begun_s
            end = int(np.searchsorted(due_s, now_s, "right"))
            if end > row:
                link.send(frames[row:end])
                played.sent += end - row
                row = end
            played.heard += len(link.receive(0.0))
            if row < len(frames) and due_s[row] > now_s:
                time.sleep(min(float(due_s[row]) - now_s, SLICE_S))
    played.wall_s = time.monotonic() - begun_s
    played.complete = not stop()
    return played
