"""A recording as epochs of one bus, each with its two sides: the emulator's frames, the flight software's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from gnss_hil.dbc.common import gpstime
from gnss_hil.dbc.common.limits import MAX_RECEIVERS
from gnss_hil.dbc.contract.codec import IDENTIFIERS, Codec, codec
from gnss_hil.dbc.contract.frames import EMPTY, SFF_MASK, FrameBatch, concat
from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.decoder.block import of_frames
from gnss_hil.tools.decoder.screen import intact
from gnss_hil.tools.decoder.time_marks import epoch_times_ns, marks_in
from gnss_hil.tools.recording.formats.piece import Piece
from gnss_hil.tools.recording.formats.recording import Recording
from gnss_hil.tools.recording.sequence import Sequencer

PEEK_EPOCHS = 16
"""Epochs whose distance in time is the interval of the recording."""


@dataclass(frozen=True, slots=True)
class RecordedEpoch:
    """One epoch; frames of both sides, each in recorded order, without the bench's."""

    number: int
    emulator: FrameBatch
    flight: FrameBatch


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRun:
    """One run on one bus.

    bus          its name in the recording
    session      of the time marks
    first        number of the first epoch
    start_ns     GPS time [ns] of epoch 0, reckoned from the first
    interval_ns  between epochs
    """

    recording: Recording
    bus: str
    codec: Codec
    session: int
    first: int
    start_ns: int
    interval_ns: int

    def epochs(self, behind: Callable[[int], None] | None = None) -> Iterator[RecordedEpoch]:
        """All epochs, from the beginning again at each call.

        behind   is told in the end how many time marks of other runs the recording holds behind this one
        """
        return _epochs(self.recording, self.bus, self.codec, behind)


def open_run(recording: Recording, bus: str | None, contract: Codec | None) -> RecordedRun:
    """The run on a bus of a recording; Mistake if there is none, or none of this contract.

    bus       name in the recording; None: the only one
    contract  None: the one that the heartbeats name
    """
    names = buses(recording)
    if bus is None:
        if len(names) != 1:
            found = f"holds {len(names)} buses: {', '.join(names)}; choose one with --craft" if names else ""
            raise Mistake(f"{recording.path}: {found or 'holds no frames'}")
        bus = names[0]
    elif bus not in names:
        raise Mistake(f"{recording.path}: holds no bus {bus}; it has {', '.join(names) or 'no frames'}")
    contract = contract or spoken_contract(recording, bus)
    begun = list(islice(_epochs(recording, bus, contract), PEEK_EPOCHS))
    if not begun:
        raise Mistake(f"{recording.path}: holds no intact time mark on {bus}; there is nothing to replay")
    numbers = np.array([epoch.number for epoch in begun])
    t_ns = _times_ns(contract, begun, numbers)
    steps = np.diff(t_ns) // np.diff(numbers)
    interval_ns = max(int(np.median(steps)), 1) if len(steps) else gpstime.NS_PER_S
    start_ns = int(t_ns[0]) - int(numbers[0]) * interval_ns
    session = int(marks_in(contract, begun[0].emulator).session[0])
    return RecordedRun(recording, bus, contract, session, int(numbers[0]), start_ns, interval_ns)


def buses(recording: Recording) -> list[str]:
    """Names of the buses in the first piece that has frames: there are epochs of all craft of a run in it."""
    first = next((piece for piece in recording.pieces() if len(piece.frames)), None)
    return [] if first is None else [name.decode() for name in np.unique(first.bus).tolist()]


def spoken_contract(recording: Recording, bus: str) -> Codec:
    """The contract whose hash the heartbeats on a bus carry."""
    four = codec()
    spoken: set[int] = set()
    for _, frames in _on_bus(recording, bus):
        numbers = [number for kind, number in four.can_id_of if kind == "HEARTBEAT"]
        beats = concat([frames[intact(four, frames, "HEARTBEAT", number)] for number in numbers])
        spoken = set(of_frames(four, beats)["HEARTBEAT"]["contract_hash"].tolist())
        if spoken:
            break
    order = (four.receivers, *(n for n in range(1, MAX_RECEIVERS + 1) if n != four.receivers))
    found = next((codec(n) for n in order if codec(n).hash in spoken), None) if spoken else None
    if found is None:
        found = f"speaks contract {min(spoken):08x}" if spoken else "has no intact heartbeat"
        raise Mistake(
            f"{recording.path}: {bus} {found}; this bench speaks {four.hash:08x} with {four.receivers} "
            "receivers; --vehicle FILE replays it all the same"
        )
    return found


def _times_ns(contract: Codec, epochs: list[RecordedEpoch], numbers: np.ndarray) -> np.ndarray:
    """(e,) GPS times [ns] of epochs: as reported; where they are not, when they were recorded."""
    blocks = [epoch.emulator for epoch in epochs]
    heard_ns = np.array([gpstime.from_unix_ns(int(block.t_ns[0])) for block in blocks])
    counts = np.array([len(block) for block in blocks])
    reported = epoch_times_ns(contract, concat(blocks), counts, numbers)
    return reported if (reported >= 0).all() else heard_ns


def _epochs(
    recording: Recording, bus: str, contract: Codec, behind: Callable[[int], None] | None = None
) -> Iterator[RecordedEpoch]:
    """The first run of a recording: it ends with BENCH_END, or where another session begins."""
    pieces, rest = _on_bus(recording, bus), EMPTY
    sequencer = None
    flight_id = np.array([contract.sender_of[i] == "FLIGHT" for i in range(IDENTIFIERS)])
    session = None
    for _, whole in pieces:
        marks = marks_in(contract, whole)
        if session is None and len(marks.session):
            session = marks.session[0]
        over = min(marks.rows[marks.session != session].tolist(), default=None)
        frames, rest = whole[:over], EMPTY if over is None else whole[over:]
        if sequencer is None:  # a run's own log has no BENCH_SYNC any more, and its frames are in order
            steered = bool((frames.can_id == contract.can_id_of["BENCH_SYNC", 0]).any())
            sequencer = Sequencer(contract, lockstep=steered)
        for epoch in sequencer.hear(frames):
            yield _sides(epoch, flight_id)
        if sequencer.ended:
            rest = whole[int((whole.can_id == contract.can_id_of["BENCH_END", 0]).argmax()) :]
        if over is not None or sequencer.ended:
            break
    for epoch in sequencer.finish() if sequencer else ():
        yield _sides(epoch, flight_id)
    if behind is not None:
        behind(sum(len(marks_in(contract, some).rows) for some in (rest, *(frames for _, frames in pieces))))


def _sides(epoch, flight_id: np.ndarray) -> RecordedEpoch:
    frames = epoch.frames
    flight = (frames.can_id <= SFF_MASK) & flight_id[frames.can_id & SFF_MASK]
    return RecordedEpoch(epoch.number, frames[~flight], frames[flight])


def _on_bus(recording: Recording, bus: str) -> Iterator[tuple[np.ndarray, FrameBatch]]:
    """UNIX times [us] and frames of one bus, piece by piece; a frame's `t_ns` is its UNIX time."""
    for piece in recording.pieces():
        yield one_bus(piece, bus)


def one_bus(piece: Piece, bus: str) -> tuple[np.ndarray, FrameBatch]:
    unix_us, names, frames, _ = piece
    mine = names == bus.encode()
    if not mine.all():
        unix_us, frames = unix_us[mine], frames[mine]
    return unix_us, replace(frames, t_ns=unix_us * 1000)
