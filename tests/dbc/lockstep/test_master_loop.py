"""The time master at a pace: epochs begin at their instants, whatever work lies between them.

Time is the test's own: it passes where the loop waits, and where work is done.
"""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, FrameBatch
from gnss_hil.dbc.lockstep import master_loop, messages
from gnss_hil.dbc.lockstep.master_loop import Bus, MasterLoop, MissingNodes, Unanswered
from tests.support.lockstep_frames import SESSION, bench_in, done, heartbeat

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


class Answering(SilentLink):
    """A bus with a flight node that answers epochs below `until`, and heartbeats before them."""

    def __init__(self, clock: Clock, until: int, heartbeats: FrameBatch = EMPTY):
        super().__init__(clock)
        self._until, self._answers, self._heartbeats = until, [], heartbeats

    def send(self, frames: FrameBatch) -> None:
        super().send(frames)
        for bench in bench_in(frames, SESSION, len(self.sent_s) - 1):
            if bench.can_id == messages.SYNC_ID and bench.epoch < self._until:
                self._answers.append(done(bench.epoch, 0))

    def receive(self, timeout_s: float | None) -> FrameBatch:
        if self._answers:
            return self._answers.pop(0)
        super().receive(timeout_s)
        return self._heartbeats


def frozen_at(clock: Clock, epoch: int, pace: float | None, **more) -> tuple[int, str]:
    """The epoch with which a run ends whose flight software answers up to one, and why."""
    master = MasterLoop({"soyuz": Bus(Answering(clock, epoch), CODEC)}, SESSION, pace, 1.0, **more)
    for k in range(1000):
        try:
            master.play(k, {"soyuz": EMPTY})
        except Unanswered as error:
            return k, str(error)
    return 1000, ""


def test_a_frozen_node_ends_a_lockstep_run_after_a_number_of_epochs(clock):
    begun_s = clock.now_s
    assert frozen_at(clock, 5, None, most_unanswered=6) == (
        10,
        "FLIGHT of soyuz has not answered for 6 epochs in a row, to epoch 10, each waited for 10 s: "
        "the run ends",
    )
    assert clock.now_s - begun_s == pytest.approx(60, abs=1)


def test_at_a_pace_a_frozen_node_ends_the_run_after_as_much_time(clock):
    last, why = frozen_at(clock, 5, 1.0, most_unanswered=6)
    assert 63 <= last <= 66 and why.startswith("FLIGHT of soyuz has not answered for 60 s, ")


@pytest.mark.parametrize(("pace", "answers", "most"), [(None, 1000, 6), (1.0, 0, 6), (0.5, 5, None)])
def test_a_run_goes_on_where_answers_come_or_are_not_to_be_expected(clock, pace, answers, most):
    """At a pace a flight software need not know bench frames."""
    assert frozen_at(clock, answers, pace, most_unanswered=most) == (1000, "")


def waited(clock: Clock, heartbeats: FrameBatch, timeout_s: float | None) -> tuple[float, list[str], str]:
    """How long a master waits at the barrier, what it tells, and why it gives up."""
    begun_s, told = clock.now_s, []
    overdue = lambda: clock.now_s > begun_s + 100  # noqa: E731
    link = Answering(clock, 0, heartbeats)
    master = MasterLoop({"soyuz": Bus(link, CODEC, "socketcan:vcan0")}, SESSION, None, 1.0, stop=overdue)
    try:
        master.assemble(timeout_s=timeout_s, tell=told.append)
    except MissingNodes as error:
        return clock.now_s - begun_s, told, str(error)
    return clock.now_s - begun_s, told, ""


def test_who_waits_says_for_whom_after_a_while(clock):
    _, told, why = waited(clock, EMPTY, 60.0)
    begin = "waiting for the flight software of soyuz on socketcan:vcan0: no heartbeat from FLIGHT so far"
    assert told == [f"{begin}; is it running, and on this bus?"]
    begin = "craft soyuz: no heartbeat from FLIGHT within 60 s"
    assert why == f"{begin}: the flight software is not running, or not on socketcan:vcan0"


def test_a_wrong_contract_is_told_at_the_first_heartbeat(clock):
    wrong = heartbeat(contract_hash=0xDEADBEEF)
    words = f"FLIGHT speaks contract 0xDEADBEEF, this bench 0x{CODEC.hash:08X} (1 receivers)"
    waited_s, told, why = waited(clock, wrong, 60.0)
    assert waited_s < 1 and why == f"craft soyuz: {words}"
    waited_s, told, why = waited(clock, wrong, None)
    assert waited_s >= 100 and told == [
        f"waiting for the flight software of soyuz on socketcan:vcan0: {words}"
    ], "it may come again"
