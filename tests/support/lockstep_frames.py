"""Frames as a time master and a flight node send them, for lockstep's tests."""

from __future__ import annotations

import numpy as np

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.dbc.lockstep import messages

CODEC = codec(4)
SESSION = 7


def mark(epoch: int, session: int = SESSION) -> FrameBatch:
    """A protected TIME_MARK."""
    data = CODEC.encode("TIME_MARK", {"session": session, "epoch": epoch}, 1)
    frames = batch([CODEC.can_id_of["TIME_MARK", 0]], data)
    return e2e.protect(CODEC, frames, e2e.fresh_counters(CODEC), epoch)[0]


def measurements(n: int, first: int = 0) -> FrameBatch:
    """n emulator frames whose payloads count up."""
    payload = np.arange(first, first + n, dtype="<u8").view(np.uint8).reshape(-1, 8)
    return batch(np.full(n, CODEC.can_id_of["RANGE", 1]), payload)


def block(epoch: int, n: int = 5, session: int = SESSION) -> FrameBatch:
    return concat((mark(epoch, session), measurements(n, 100 * epoch)))


def statuses() -> FrameBatch:
    ids = [CODEC.can_id_of["STATUS", r] for r in (1, 2, 3, 4)]
    return batch(ids, np.zeros((4, 8), np.uint8))


def navigation(epoch: int, n: int = 3) -> FrameBatch:
    """n flight frames that say which epoch they answer."""
    return batch(np.full(n, CODEC.can_id_of["NAV_X", 0]), np.full((n, 8), epoch % 256, np.uint8))


def heartbeat(number: int = FLIGHT_NODE, contract_hash: int | None = None) -> FrameBatch:
    values = {
        "state": 1,
        "boot_count": 3,
        "contract_hash": CODEC.hash if contract_hash is None else contract_hash,
    }
    frames = batch([CODEC.can_id_of["HEARTBEAT", number]], CODEC.encode("HEARTBEAT", values, 1))
    return e2e.protect(CODEC, frames, e2e.fresh_counters(CODEC), 0)[0]


def sync(epoch: int, count: int, session: int = SESSION) -> FrameBatch:
    return messages.encode(messages.SYNC_ID, session, epoch, count)


def bench_in(frames: FrameBatch, session: int, epoch: int) -> list[messages.Bench]:
    """The bench frames that are believed in an epoch."""
    found = [messages.judge(frames, row, session, epoch) for row in messages.rows(frames)]
    return [frame for frame in found if isinstance(frame, messages.Bench)]


def done(epoch: int, count: int, session: int = SESSION) -> FrameBatch:
    return messages.encode(messages.DONE_ID, session, epoch, count)
