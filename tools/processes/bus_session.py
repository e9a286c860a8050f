"""One bus of a run on its way into the record, and what the bus itself tells of how the run goes."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gnss_hil.dbc.common.gpstime import NS_PER_S
from gnss_hil.dbc.contract.codec import Codec
from gnss_hil.dbc.contract.frames import SFF_MASK, FrameBatch, concat
from gnss_hil.dbc.lockstep.latency import Latency
from gnss_hil.tools.decoder.block import EPOCHS
from gnss_hil.tools.decoder.time_marks import epoch_times_ns
from gnss_hil.tools.live.display import Display
from gnss_hil.tools.processes.bus_tap import SOMEBODY, BusTap
from gnss_hil.tools.recording.account import Heard
from gnss_hil.tools.recording.recorder import Recorder
from gnss_hil.tools.recording.sequence import Epoch, Sequencer
from gnss_hil.tools.recording.speakers import Speakers


@dataclass(slots=True, eq=False)
class BusSession:
    """One bus: its tap, the order of its frames, the record.

    watched  the emulator is another's: times, latency and the end are known from the bus alone
    end_ns   simulated time [ns since the first mark] at which the run is over, where it is watched
    last     the last epoch on record; first: its first one's number
    begun_ns, heard_ns  wall time of the first and the last frame on record
    recorded epochs on record
    first_mark_ns   GPS time [ns] of the first epoch where it is watched; -1: not known yet
    over     simulated time has reached the end: what comes now is no part of the run
    latency  where it is watched: from the last frame of the emulator to the last of the fix
    """

    number: int
    codec: Codec
    tap: BusTap
    sequencer: Sequencer
    recorder: Recorder
    display: Display
    watched: bool = False
    end_ns: int = 0
    interval_ns: int = NS_PER_S
    first: int = 0
    last: Epoch | None = None
    begun_ns: int = 0
    heard_ns: int = 0
    over: bool = False
    recorded: int = 0
    first_mark_ns: int = -1
    latency: Latency = field(default_factory=Latency)
    speakers: Speakers = field(init=False)
    _heard_s: float = field(default_factory=time.monotonic)

    def __post_init__(self):
        self.speakers = Speakers(self.codec)

    def take(self) -> None:
        """Record the epochs that what was heard completes."""
        pieces = self.tap.take()
        for peer, frames in pieces:
            if peer != SOMEBODY:
                self.speakers.hear(peer, frames, self.sequencer.session)
        if pieces:
            self._heard_s = time.monotonic()
            self._record(self.sequencer.hear(concat(frames for _, frames in pieces)))

    @property
    def account(self) -> Heard:
        """What was counted up to now."""
        of, speakers = self.sequencer, self.speakers
        return replace(of.account(self.recorded), several=speakers.several, contested=speakers.contested)

    @property
    def silent_s(self) -> float:
        """Wall time since anything was heard."""
        return time.monotonic() - self._heard_s

    def finish(self) -> None:
        self.take()
        self._record(self.sequencer.finish())

    @property
    def epochs(self) -> int:
        """Epochs from the first to the last on record."""
        return 0 if self.last is None else self.last.number - self.first + 1

    @property
    def wall_s(self) -> float:
        return (self.heard_ns - self.begun_ns) / NS_PER_S

    def _record(self, closed: list[Epoch]) -> None:
        for epoch in closed:
            if self.over:
                return
            if self.last is None:
                self.first = epoch.number
            self.recorder.add(self.number, epoch.number, epoch.frames)
            self.display.hear(self.number, epoch.number, epoch.frames)
            if self.watched:
                self._watch(epoch)
            self.last = epoch
            self.recorded += 1

    def _watch(self, epoch: Epoch) -> None:
        """Times of an epoch, as its emulator does not report to us."""
        frames = epoch.frames
        self.heard_ns = int(frames.t_ns.max())
        if self.last is None:
            self.begun_ns = int(frames.t_ns.min())
        delay_s = answer_s(self.codec, frames, epoch.number)
        if delay_s is not None:
            self.latency.add(delay_s)
        mark_ns = int(
            epoch_times_ns(self.codec, frames, np.array([len(frames)]), np.array([epoch.number]))[0]
        )
        if mark_ns < 0:
            return
        if self.first_mark_ns < 0:
            self.first_mark_ns = mark_ns - (epoch.number - self.first) * self.interval_ns
        self.over = mark_ns - self.first_mark_ns + self.interval_ns >= self.end_ns


@cache
def _identifiers(codec: Codec) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(2048,) whether an identifier is the flight software's, and whether it is navigation."""
    flight = np.array([sender == "FLIGHT" for sender in codec.sender_of])
    navigation = np.zeros(len(flight), bool)
    navigation[[can_id for (kind, _), can_id in codec.can_id_of.items() if kind.startswith("NAV_")]] = True
    return flight, navigation


def answer_s(codec: Codec, frames: FrameBatch, epoch: int) -> float | None:
    """Wall time [s] from the last frame of the emulator to the last of the epoch's navigation, by when they
    were heard; None if the epoch has no navigation of its own."""
    flight, navigation = (of[frames.can_id & SFF_MASK] for of in _identifiers(codec))
    answer_ns = frames.t_ns[navigation & (frames.data[:, 1] >> 4 == epoch % EPOCHS)]
    if not len(answer_ns):
        return None
    before_ns = frames.t_ns[~flight & (frames.t_ns <= answer_ns.min())]
    return int(answer_ns.max() - before_ns.max()) / NS_PER_S if len(before_ns) else None
