"""Both loops at work on an in-process bus: paces, restarts, silence, somebody else's emulator."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager, suppress

import pytest

from gnss_hil.dbc.bus.base import LinkClosed
from gnss_hil.dbc.bus.inline import InlineBus
from gnss_hil.dbc.bus.probe import senders_heard
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, concat
from gnss_hil.dbc.lockstep.master_loop import Bus, MasterLoop, MissingNodes, parse_pace
from gnss_hil.dbc.lockstep.messages import SYNC_ID, is_bench
from gnss_hil.dbc.lockstep.slave_loop import run_slave
from gnss_hil.dbc.lockstep.slave_protocol import Slave
from tests.support.lockstep_frames import CODEC, SESSION, block, heartbeat, mark, navigation, statuses
from tests.support.waiting import HANG_S, finished, pause, until

pytestmark = pytest.mark.verifies(what="The emulator and the flight software as processes")


class Flight:
    """A flight node in a thread: answers with as many frames as epochs it has flown since it was fresh.

    before  what it does with each block before it answers
    """

    def __init__(self, bus: InlineBus, before: Callable[[], object] = lambda: None, **more):
        self.blocks, self.fresh, self._before = [], [], before
        self._leave = False
        self.link = bus.connect()
        self._thread = threading.Thread(target=self._run, kwargs=more)
        self._thread.start()

    def _run(self, **more):
        with suppress(LinkClosed):
            run_slave(self.link, Slave(CODEC), heartbeat(), self._play, lambda: self._leave, **more)

    def _play(self, heard, fresh):
        self._before()
        self.blocks.append(heard)
        self.fresh.append(fresh)
        return navigation(len(self.blocks))

    def leave(self):
        self._leave = True
        self._thread.join()


@pytest.fixture
def bus():
    bus = InlineBus()
    yield bus
    bus.close()


@contextmanager
def flight(bus, **more):
    node = Flight(bus, **more)
    try:
        yield node
    finally:
        node.leave()


def master_loop(bus, pace=None, interval_s=1.0, session=SESSION, **more) -> MasterLoop:
    return MasterLoop({"soyuz": Bus(bus.connect(), CODEC)}, session, pace, interval_s, **more)


def play(master, epochs, session=SESSION):
    return [master.play(k, {"soyuz": block(k, session=session)})["soyuz"] for k in epochs]


def test_lockstep_answers_every_epoch(bus):
    with flight(bus) as node:
        master = master_loop(bus)
        master.assemble(timeout_s=HANG_S)
        inboxes = play(master, range(50))
    assert inboxes == [navigation(k + 1) for k in range(50)]
    assert node.blocks == [block(k) for k in range(50)]
    assert node.fresh == [True] + [False] * 49
    assert (master.tally.unanswered, master.tally.sent, master.tally.received) == (0, 300, 150)
    assert 0 < master.tally.latency.percentile_s(50) <= master.tally.latency.percentile_s(99)


def test_a_slow_node_is_asked_again_and_answers_once(bus):
    """It answers each epoch only when it was asked for it twice."""
    spy, heard, over = bus.connect(), [], threading.Event()

    def asked_twice():
        heard.append(spy.receive(0.02))
        return over.is_set() or sum((f.can_id == SYNC_ID).sum() for f in heard) >= 2 * (len(node.blocks) + 1)

    with flight(bus, before=lambda: until(asked_twice)) as node:
        master = master_loop(bus, repeat_s=0.02)
        master.assemble(timeout_s=HANG_S)
        try:
            assert play(master, range(4)) == [navigation(k + 1) for k in range(4)]
        finally:
            over.set()
    assert len(node.blocks) == 4


def test_the_barrier_waits_and_then_says_who_is_missing(bus):
    master = master_loop(bus)
    with pytest.raises(MissingNodes, match=r"craft soyuz: no heartbeat from FLIGHT within 0\.2 s"):
        master.assemble(timeout_s=0.2)


def test_nobody_answers_and_time_goes_on(bus):
    master = master_loop(bus, limit_s=0.15)
    assert play(master, range(2)) == [EMPTY, EMPTY]
    assert master.tally.unanswered == 2


def test_a_node_that_started_anew_is_not_waited_for(bus):
    given_up = threading.Event()
    guard = threading.Timer(HANG_S, given_up.set)
    master, joined = master_loop(bus, limit_s=math.inf, stop=given_up.is_set), []
    guard.start()
    with flight(bus):
        master.assemble(timeout_s=HANG_S)
        play(master, range(3))
    restart = threading.Timer(0.3, lambda: joined.append(Flight(bus)))
    restart.start()
    assert play(master, [3]) == [EMPTY]
    assert master.tally.unanswered == 1 and not given_up.is_set()
    guard.cancel()
    assert play(master, [4, 5]) == [navigation(1), navigation(2)]
    joined[0].leave()
    assert joined[0].fresh == [True, False]


def test_announcements_that_waited_somewhere_are_no_restart(bus):
    """A bus that stood still delivers all at once what a node said before it heard the block."""
    stranger = bus.connect()
    with flight(bus, before=lambda: stranger.send(concat([heartbeat()] * 20))) as node:
        master = master_loop(bus)
        master.assemble(timeout_s=HANG_S)
        play(master, [0])
        assert master.tally.unanswered == 0 and len(node.blocks) == 1


def test_a_stop_ends_waiting_without_blaming_the_node(bus):
    master = master_loop(bus, stop=lambda: True)
    master.assemble()
    assert play(master, [0]) == [EMPTY]
    assert master.tally.unanswered == 0


def test_free_running_keeps_wall_time_and_answers(bus):
    with flight(bus) as node:
        master = master_loop(bus, pace=100.0)
        master.assemble(timeout_s=HANG_S)
        begun_s = time.monotonic()
        inboxes = play(master, range(50))
        took_s = time.monotonic() - begun_s
        until(lambda: len(node.blocks) == 50)
        inboxes += play(master, [50])  # by then the last answers have come
    assert took_s > 0.49
    answers = concat(inboxes)
    assert set(answers.data[:, 0].tolist()) >= set(range(1, 51))


def test_a_node_too_slow_for_the_pace_is_counted_and_still_heard(bus):
    with flight(bus, before=lambda: pause(0.03)) as node:
        master = master_loop(bus, pace=100.0)
        master.assemble(timeout_s=HANG_S)
        play(master, range(10))
        unanswered = master.tally.unanswered
        until(lambda: node.blocks[-1] == block(9))
        late = play(master, [10])
    assert unanswered >= 5
    assert len(concat(late)) > 0


def test_a_node_outlives_its_emulator(bus):
    """The first run stops without a word; the next one, even with the same session, finds the node ready."""
    with flight(bus, silence_s=0.3) as node:
        for session in (SESSION, SESSION + 1, SESSION + 1):
            master = master_loop(bus, session=session)
            master.assemble(timeout_s=HANG_S)
            assert len(play(master, range(3), session)) == 3
    assert node.fresh == [True, False, False] * 3


def test_once_means_the_first_runs_end(bus):
    node = Flight(bus, once=True)
    master = master_loop(bus)
    master.assemble(timeout_s=HANG_S)
    play(master, range(2))
    master.end(2, "COMPLETED")
    finished(node._thread)


def test_somebody_elses_emulator_needs_no_bench_frames(bus):
    emulator = bus.connect()
    answers = []

    def hear(count):
        def heard():
            answers.append(emulator.receive(0.05))
            return sum(len(frames[frames.can_id < 0x700]) for frames in answers) >= count

        until(heard)

    with flight(bus) as node:
        until(lambda: len(emulator.receive(0.1)))  # its heartbeat
        for k in range(3):
            emulator.send(concat((block(k), statuses())))
            hear(3 * k)
        emulator.send(mark(3))
        hear(9)
    assert node.blocks[:3] == [concat((block(k), statuses())) for k in range(3)]
    heard = concat(answers)
    assert not is_bench(heard.can_id).any()


def test_an_occupied_bus_is_noticed(bus):
    listener, other = bus.connect(), bus.connect()
    assert senders_heard(listener, CODEC, {"TIME", "RX1"}, 0.05) == set()
    other.send(concat((mark(0), heartbeat())))
    assert senders_heard(listener, CODEC, {"TIME", "RX1"}, 0.05) == {"TIME"}


@pytest.mark.parametrize(
    ("text", "pace"), [("lockstep", None), ("realtime", 1.0), ("x10", 10.0), ("x0.5", 0.5)]
)
def test_paces(text, pace):
    assert parse_pace(text) == pace


@pytest.mark.parametrize("text", ["", "x", "x0", "x-1", "10", "xnan", "xinf", "fast"])
def test_no_paces(text):
    with pytest.raises(ValueError, match="not one of lockstep, realtime, xN"):
        parse_pace(text)


def test_two_craft_have_a_bus_each():
    buses = {name: InlineBus() for name in ("soyuz", "station")}
    nodes = [Flight(bus) for bus in buses.values()]
    master = MasterLoop({n: Bus(b.connect(), codec(4)) for n, b in buses.items()}, SESSION, None, 1.0)
    master.assemble(timeout_s=HANG_S)
    for k in range(3):
        blocks = {"soyuz": block(k), "station": block(k, 2)}
        assert master.play(k, blocks) == {name: navigation(k + 1) for name in buses}
    for node in nodes:
        node.leave()
    assert [len(b) for b in nodes[1].blocks] == [3, 3, 3]
