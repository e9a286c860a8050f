"""The time master at a pace: epochs begin at their instants, whatever work lies between them.

Time is the test's own: it passes where the loop waits, and where work is done.
"""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.dbc.lockstep import master_loop
from gnss_hil.dbc.lockstep.master_loop import Bus, MasterLoop

CODEC = codec(1)


class Clock:
    """Stands for the module `time`."""

    def __init__(self):
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    perf_counter = monotonic

    def sleep(self, seconds: float) -> None:
        self.now_s += max(seconds, 1e-6)


class SilentLink:
    """A bus on which nothing is heard; it keeps when something was sent."""

    dropped = 0

    def __init__(self, clock: Clock):
        self._clock, self.sent_s = clock, []

    def send(self, frames: FrameBatch) -> None:
        self.sent_s.append(self._clock.now_s)

    def receive(self, timeout_s: float | None) -> FrameBatch:
        self._clock.sleep(timeout_s or 0.0)
        return EMPTY


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(master_loop, "time", clock)
    return clock


def played(clock: Clock, period_s: float, step_s: float, ahead_s: float, epochs: int = 40):
    """How late each epoch was sent after its instant, (epochs,) [s], and how often work was done ahead."""
    link, ahead = SilentLink(clock), []
    master = MasterLoop({"craft": Bus(link, CODEC)}, 7, 1.0, period_s)

    def meanwhile():
        ahead.append(clock.now_s)
        clock.now_s += ahead_s

    for epoch in range(epochs):
        clock.now_s += step_s
        master.play(epoch, {"craft": EMPTY}, meanwhile)
    late_s = [sent - link.sent_s[0] - k * period_s for k, sent in enumerate(link.sent_s)]
    return late_s, ahead, master


@pytest.mark.parametrize(
    ("period_s", "step_s", "ahead_s"), [(1.0, 0.02, 0.45), (0.1, 0.01, 0.04), (1.0, 0.3, 0.0)]
)
def test_epochs_begin_at_their_instants(clock, period_s, step_s, ahead_s):
    late_s, ahead, master = played(clock, period_s, step_s, ahead_s)
    assert late_s[1] == pytest.approx(step_s, abs=1e-3), "how long a step takes is not known before"
    assert max(late_s[2:]) < 1e-4
    assert len(ahead) == 40, "once an epoch"
    assert master.tally.late_s == pytest.approx(step_s, abs=1e-3)


def test_a_step_that_takes_longer_once_is_late_once(clock):
    link = SilentLink(clock)
    master = MasterLoop({"craft": Bus(link, CODEC)}, 7, 1.0, 1.0)
    for epoch in range(20):
        clock.now_s += 0.2 if epoch == 10 else 0.01
        master.play(epoch, {"craft": EMPTY})
    late_s = [sent - link.sent_s[0] - k for k, sent in enumerate(link.sent_s)]
    assert late_s[10] == pytest.approx(0.2 - 0.015, abs=2e-3)
    assert max(late_s[2:10] + late_s[11:]) < 1e-4
    assert master.tally.late_s == pytest.approx(late_s[10], abs=1e-6)


def test_a_master_that_fell_behind_by_an_epoch_starts_anew(clock):
    link = SilentLink(clock)
    master = MasterLoop({"craft": Bus(link, CODEC)}, 7, 1.0, 1.0)
    for epoch in range(6):
        clock.now_s += 3.5 if epoch == 3 else 0.01
        master.play(epoch, {"craft": EMPTY})
    apart_s = [after - before for before, after in zip(link.sent_s, link.sent_s[1:], strict=False)]
    assert apart_s[2] > 3
    assert apart_s[3:] == pytest.approx([1.0, 1.0], abs=1e-3), "none is hurried"
    assert master.tally.late_s > 2


def test_half_of_the_time_that_is_left_is_for_listening(clock):
    link = SilentLink(clock)
    master = MasterLoop({"craft": Bus(link, CODEC)}, 7, 1.0, 1.0)
    for epoch in range(5):
        clock.now_s += 0.9
        master.play(epoch, {"craft": EMPTY})
        left_s = link.sent_s[0] + epoch + 1 - link.sent_s[-1]
        assert left_s < 0 or clock.now_s - link.sent_s[-1] >= left_s / 2 - 1e-5
