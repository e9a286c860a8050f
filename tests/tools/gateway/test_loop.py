"""The gateway's loop with links that do what real ones may."""

from __future__ import annotations

import os

import pytest

from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.tools.gateway.crossing import Crossing
from gnss_hil.tools.gateway.loop import run_gateway
from gnss_hil.tools.gateway.strikes import Strikes
from tests.support.faulted import plan_of
from tests.support.lockstep_frames import CODEC, heartbeat, mark

pytestmark = pytest.mark.verifies(
    "tools/gateway/loop.py",
    what="Frames that a bus has read while it sent are passed on",
    by="a link that holds frames of which its descriptor does not tell",
    status="validated",
)


class Busy:
    """A link that reads while it sends, a frame each time, as one does whose peer sends much at once; its
    descriptor never tells of anything."""

    def __init__(self, *read: FrameBatch):
        self.sent: list[FrameBatch] = []
        self.dropped = 0
        self._read, self._here = [*read], EMPTY
        self._quiet, self._end = os.pipe()

    def send(self, frames: FrameBatch) -> None:
        self.sent.append(frames)
        self._here = self._read.pop(0) if self._read else EMPTY

    def receive(self, timeout_s: float) -> FrameBatch:
        frames, self._here = self._here, EMPTY
        return frames

    def fileno(self) -> int:
        return self._quiet

    def close(self) -> None:
        os.close(self._quiet)
        os.close(self._end)


def test_what_a_link_read_while_it_sent_is_passed_on_at_once():
    outer, inner = Busy(heartbeat(), mark(4)), Busy(mark(3))
    outer.send(EMPTY)  # it has read a heartbeat by now
    links = {Direction.RECEIVERS: outer, Direction.FLIGHT: inner}
    turns = iter(range(3))
    crossing = Crossing(CODEC, Strikes(lambda session: plan_of()))
    run_gateway(links, crossing, lambda: next(turns, None) is None)
    assert inner.sent == [heartbeat(), mark(4)]
    assert outer.sent == [EMPTY, mark(3)]
    for link in (outer, inner):
        link.close()
