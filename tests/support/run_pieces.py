"""Frames of a short run, in the pieces that a recorder hears."""

from __future__ import annotations

from gnss_hil.dbc.contract import codec, e2e
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.recording.sequence import Sequencer

CODEC = codec.codec(4)
SESSION = 7


def frame(name: str, mark: int, number: int = 0, header: int = 0) -> FrameBatch:
    """A frame of a kind that can be told from others by `mark`."""
    return batch([CODEC.can_id_of[name, number]], bytes([0, header, mark, 0, 0, 0, 0, 0]))


def time_mark(epoch: int, session: int = SESSION) -> FrameBatch:
    payload = CODEC.encode("TIME_MARK", {"session": session, "epoch": epoch}, 1)
    mark = batch([CODEC.can_id_of["TIME_MARK", 0]], payload)
    return e2e.protect(CODEC, mark, e2e.fresh_counters(CODEC), epoch)[0]


def emulated(epoch: int) -> FrameBatch:
    return concat([time_mark(epoch), frame("RANGE", epoch % 256, 1)])


def flown(epoch: int) -> FrameBatch:
    return concat([frame("NAV_STATUS", epoch), frame("HEARTBEAT", epoch, 16, header=epoch % 16 << 4 | 1)])


def sync(epoch: int) -> FrameBatch:
    return messages.encode(messages.SYNC_ID, SESSION, epoch, 2)


def done(epoch: int, count: int = 2) -> FrameBatch:
    return messages.encode(messages.DONE_ID, SESSION, epoch, count)


GREETING = frame("HEARTBEAT", 99, 16)
CANONICAL = [(0, concat([emulated(0), flown(0)])), (1, concat([emulated(1), flown(1)]))]


def recorded(*heard: FrameBatch, piece: int = 1000, lockstep: bool = True) -> list[tuple[int, FrameBatch]]:
    """Epochs that a sequencer makes of what it hears in pieces."""
    sequencer, bus = Sequencer(CODEC, lockstep), concat(heard)
    epochs = [e for i in range(0, len(bus), piece) for e in sequencer.hear(bus[i : i + piece])]
    return [(e.number, e.frames) for e in [*epochs, *sequencer.finish()]]


PLAIN = [emulated(0), sync(0), flown(0), done(0), emulated(1), sync(1), flown(1), done(1)]


def sealed(frames: FrameBatch, epoch: int) -> FrameBatch:
    """As a node sends them that begins in that epoch."""
    return e2e.protect(CODEC, frames, e2e.fresh_counters(CODEC), epoch)[0]
