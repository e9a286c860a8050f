"""What crosses a gateway, frame by frame: order, counts, what closes an epoch, what repeats."""

from __future__ import annotations

import pytest

from gnss_hil.dbc.contract.frames import FrameBatch, batch, concat
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.messages import recounted
from gnss_hil.emulator.faults.base import Direction
from gnss_hil.tools.gateway.crossing import Crossing
from gnss_hil.tools.gateway.cut import QUIET_S
from gnss_hil.tools.gateway.strikes import Strikes
from tests.support.faulted import plan_of
from tests.support.lockstep_frames import (
    CODEC,
    SESSION,
    block,
    heartbeat,
    mark,
    measurements,
    navigation,
    statuses,
    sync,
)

FLIGHT, RECEIVERS = Direction.FLIGHT, Direction.RECEIVERS

pytestmark = pytest.mark.verifies(
    "tools/gateway/crossing.py",
    "tools/gateway/blocks.py",
    "tools/gateway/answers.py",
    "tools/gateway/cut.py",
    "tools/gateway/strikes.py",
    what="Epochs cut and counted between two buses",
    by="hand-made sequences: repeated, late and lost bench frames, other nodes, other sessions",
    status="validated",
)


class Bench:
    """A gateway between two lists of frames."""

    def __init__(self, *faults: str):
        self.crossing = Crossing(CODEC, Strikes(lambda session: plan_of(*faults)))
        self.now_s = 0.0

    def says(self, way: Direction, *frames: FrameBatch) -> dict[Direction, FrameBatch]:
        """What leaves, each way, when these frames come in one piece."""
        return _sorted(self.crossing.hear(way, concat(frames), self.now_s))

    def silence(self) -> dict[Direction, FrameBatch]:
        self.now_s += QUIET_S
        return _sorted(self.crossing.expire(self.now_s))


def _sorted(leaving) -> dict[Direction, FrameBatch]:
    leaving = [*leaving]
    return {way: concat([one.frames for one in leaving if one.direction is way]) for way in Direction}


def done(epoch: int, count: int, session: int = SESSION) -> FrameBatch:
    return messages.encode(messages.DONE_ID, session, epoch, count)


def end(epoch: int) -> FrameBatch:
    return messages.encode(messages.END_ID, SESSION, epoch, 0)


def status(epoch: int) -> FrameBatch:
    return batch([CODEC.can_id_of["NAV_STATUS", 0]], bytes([0, 0, epoch]))


LATER = "RX1_RANGE loss @1h"
DROPS = "RX1_RANGE loss @#1..#2"
MORE = "NAV_X repetition 1 @#0..#3"


def test_without_faults_what_comes_leaves_at_once():
    bench = Bench()
    assert bench.says(FLIGHT, mark(0))[FLIGHT] == mark(0)
    assert bench.says(FLIGHT, measurements(3))[FLIGHT] == measurements(3)
    assert bench.says(RECEIVERS, navigation(0))[RECEIVERS] == navigation(0)
    assert bench.crossing.epochs == 1 and not bench.crossing.ended
    assert bench.says(FLIGHT, end(1))[FLIGHT] == end(1)
    assert bench.crossing.ended


def test_a_block_waits_for_its_sync_and_leaves_whole():
    bench = Bench(LATER)
    assert not len(bench.says(FLIGHT, block(0))[FLIGHT])
    assert bench.says(FLIGHT, sync(0, 6))[FLIGHT] == concat((block(0), sync(0, 6)))


def test_heartbeats_of_the_start_barrier_pass():
    bench = Bench(LATER, "FLIGHT silence @0..")
    assert bench.says(RECEIVERS, heartbeat())[RECEIVERS] == heartbeat()


def test_sync_counts_what_leaves_and_a_repeated_one_says_it_again():
    bench = Bench(DROPS)
    assert bench.says(FLIGHT, block(0), sync(0, 6))[FLIGHT] == concat((block(0), sync(0, 6)))
    assert bench.says(FLIGHT, block(1), sync(1, 6))[FLIGHT] == concat((mark(1), sync(1, 1)))
    assert bench.says(FLIGHT, sync(1, 6))[FLIGHT] == sync(1, 1)
    assert bench.says(FLIGHT, block(2), sync(2, 6))[FLIGHT] == concat((block(2), sync(2, 6)))


def test_a_sync_that_counted_frames_lost_before_still_does():
    bench = Bench(DROPS)
    bench.says(FLIGHT, block(0), sync(0, 6))
    assert bench.says(FLIGHT, block(1), sync(1, 8))[FLIGHT] == concat((mark(1), sync(1, 3)))


def test_done_counts_what_leaves_and_a_repeated_answer_is_the_same():
    bench = Bench(MORE)
    bench.says(FLIGHT, block(0), sync(0, 6))
    answer = concat((navigation(0, 2), done(0, 2)))
    twice = navigation(0, 4)
    assert bench.says(RECEIVERS, answer)[RECEIVERS] == concat((twice, done(0, 4)))
    assert bench.says(RECEIVERS, answer)[RECEIVERS] == concat((twice, done(0, 4)))
    other = measurements(1)
    assert bench.says(RECEIVERS, other, answer)[RECEIVERS] == concat((other, twice, done(0, 4)))


def test_greetings_before_an_answer_are_not_part_of_it():
    bench = Bench("FLIGHT_HEARTBEAT loss")
    bench.says(FLIGHT, block(0), sync(0, 6))
    answer = (navigation(0, 2), done(0, 2))
    greeted = bench.says(RECEIVERS, heartbeat(), heartbeat(), *answer)[RECEIVERS]
    assert greeted == concat((heartbeat(), heartbeat(), *answer))
    bench.says(FLIGHT, block(1), sync(1, 6))
    told = (navigation(1, 2), heartbeat(), done(1, 3))
    assert bench.says(RECEIVERS, *told)[RECEIVERS] == concat((navigation(1, 2), done(1, 2)))


def test_a_node_that_starts_anew_is_heard_though_it_owes_an_answer():
    bench = Bench(LATER)
    bench.says(FLIGHT, block(0), sync(0, 6))
    bench.says(RECEIVERS, navigation(0), done(0, 3))
    bench.says(FLIGHT, block(1), sync(1, 6))
    assert not len(bench.says(RECEIVERS, heartbeat())[RECEIVERS])
    assert bench.crossing.due_s() == QUIET_S
    assert bench.silence()[RECEIVERS] == heartbeat()
    assert bench.crossing.due_s() is None


def test_strays_pass_in_their_place():
    bench = Bench(LATER)
    stray = sync(400, 1, session=9)
    assert bench.says(FLIGHT, mark(0), stray, measurements(2), sync(0, 3))[FLIGHT] == concat(
        (mark(0), stray, measurements(2), sync(0, 3))
    )
    late = done(90, 1)
    assert bench.says(RECEIVERS, late, navigation(0), done(0, 3))[RECEIVERS] == concat(
        (late, navigation(0), done(0, 3))
    )


def test_an_epoch_whose_mark_was_lost_is_the_next_one():
    bench = Bench(DROPS)
    bench.says(FLIGHT, block(0), sync(0, 6))
    assert bench.says(FLIGHT, measurements(4), sync(1, 5))[FLIGHT] == sync(1, 1)


def test_without_sync_the_next_mark_closes_an_epoch():
    bench = Bench(DROPS)
    assert not len(bench.says(FLIGHT, block(0))[FLIGHT])
    assert bench.says(FLIGHT, block(1))[FLIGHT] == block(0)
    assert bench.says(FLIGHT, block(2))[FLIGHT] == mark(1)


def test_without_sync_silence_behind_all_statuses_closes_an_epoch():
    bench = Bench(LATER)
    bench.says(FLIGHT, block(0), statuses()[:3])
    assert bench.crossing.due_s() is None
    bench.says(FLIGHT, statuses()[3:])
    assert bench.crossing.due_s() == QUIET_S
    assert bench.silence()[FLIGHT] == concat((block(0), statuses()))


def test_without_done_silence_behind_the_navigation_closes_an_answer():
    bench = Bench(MORE)
    bench.says(FLIGHT, block(0), sync(0, 6))
    bench.says(RECEIVERS, status(0), navigation(0, 1))
    assert bench.silence()[RECEIVERS] == concat((status(0), navigation(0, 2)))
    bench.says(RECEIVERS, navigation(0, 1))
    assert bench.crossing.due_s() is None, "an epoch passes the faults once; what is late goes with the next"
    assert not len(bench.says(FLIGHT, block(1), sync(1, 6))[RECEIVERS])
    bench.says(RECEIVERS, status(1))
    assert bench.silence()[RECEIVERS] == concat((navigation(0, 2), status(1)))


def test_without_done_and_navigation_the_next_epoch_closes_an_answer():
    bench = Bench(MORE)
    bench.says(FLIGHT, block(0), sync(0, 6))
    bench.says(RECEIVERS, navigation(0, 1))
    assert bench.says(FLIGHT, block(1), sync(1, 6))[RECEIVERS] == navigation(0, 2)


def test_a_run_that_begins_anew_finds_faults_as_new():
    bench = Bench("RX1_RANGE loss @#0..#1")
    assert bench.says(FLIGHT, block(0), sync(0, 6))[FLIGHT] == concat((mark(0), sync(0, 1)))
    assert bench.says(FLIGHT, block(1), sync(1, 6))[FLIGHT] == concat((block(1), sync(1, 6)))
    bench.says(RECEIVERS, navigation(1, 1))
    again = bench.says(FLIGHT, block(0, session=8), sync(0, 6, session=8))
    assert again[FLIGHT] == concat((mark(0, 8), sync(0, 1, session=8)))
    assert again[RECEIVERS] == navigation(1, 1)


def test_the_end_takes_along_what_waits():
    bench = Bench(LATER)
    bench.says(FLIGHT, block(0), sync(0, 6))
    assert bench.says(FLIGHT, block(1), end(2))[FLIGHT] == concat((block(1), end(2)))
    assert bench.crossing.ended and bench.crossing.epochs == 2


def test_an_end_of_another_session_is_none():
    bench = Bench(LATER)
    bench.says(FLIGHT, block(0), sync(0, 6))
    other = messages.encode(messages.END_ID, 9, 1, 0)
    bench.says(FLIGHT, other)
    assert not bench.crossing.ended
    assert _sorted(bench.crossing.rest())[FLIGHT] == other


@pytest.mark.parametrize(("count", "more", "left"), [(5, 2, 7), (5, -7, 0), (65530, 9, 65535), (3, -3, 0)])
def test_counts_stay_within_what_a_frame_can_say(count, more, left):
    assert recounted(sync(70_001, count), more) == sync(70_001, left)
