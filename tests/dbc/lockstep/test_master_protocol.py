"""The time master's side: barrier and exchange."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e, screening
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EMPTY, ERR_FLAG, FrameBatch, batch, concat
from gnss_hil.dbc.contract.messages import FLIGHT_NODE, TIME_NODE
from gnss_hil.dbc.lockstep import messages
from gnss_hil.dbc.lockstep.master_protocol import Barrier, Exchange
from gnss_hil.dbc.lockstep.messages import Bench, Refusal
from tests.support.lockstep_frames import (
    CODEC,
    SESSION,
    block,
    done,
    heartbeat,
    measurements,
    navigation,
    sync,
)

pytestmark = pytest.mark.verifies(
    "dbc/lockstep/messages.py",
    "dbc/lockstep/master_protocol.py",
    "dbc/lockstep/slave_protocol.py",
    "dbc/lockstep/master_loop.py",
    "dbc/lockstep/slave_loop.py",
    what="Lockstep: barrier, epochs, repetitions, both sides",
    by="a protocol of our own, docs/contract.md; the same bytes whichever side pauses or comes late",
    status="modelled",
)


def test_bench_frames_are_laid_out_as_the_database_says():
    for kind, can_id in (("BENCH_SYNC", messages.SYNC_ID), ("BENCH_DONE", messages.DONE_ID)):
        frame = messages.encode(can_id, 0xABCD, 0x12345678, 0x4321)
        said = {k: int(v[0]) for k, v in CODEC.decode(kind, frame.data).items()}
        assert said == {
            "e2e_crc": frame.data[0, 0], "e2e_counter": 0x12345678 % 15, "epoch_mod16": 8,
            "epoch": 0x5678, "session": 0xABCD, "count": 0x4321,
        }  # fmt: skip
        assert screening.screen(CODEC, frame, e2e.fresh_counters(CODEC)).verdict.tolist() == [
            screening.Verdict.OK
        ]
        assert messages.judge(frame, 0, 0xABCD, 0x12345678) == Bench(can_id, 0xABCD, 0x12345678, 0x4321)
    end = messages.encode(messages.END_ID, 1, 600, messages.END_REASON["INTERRUPTED"])
    assert CODEC.decode("BENCH_END", end.data)["reason"][0] == 1


def test_sessions_of_seeds_fit_the_signal_and_differ():
    sessions = {messages.session_of(seed) for seed in range(1000)}
    assert 0 not in sessions and max(sessions) < 1 << 16
    assert len(sessions) > 950


def test_barrier_opens_when_every_required_node_spoke_this_contract():
    barrier = Barrier(CODEC, (FLIGHT_NODE, TIME_NODE))
    assert barrier.missing == (FLIGHT_NODE, TIME_NODE)
    barrier.hear(heartbeat(FLIGHT_NODE))
    assert barrier.missing == (TIME_NODE,)
    assert barrier.explain() == "no heartbeat from TIME"
    barrier.hear(concat((measurements(3), heartbeat(TIME_NODE))))
    assert barrier.missing == () and barrier.explain() == ""


def test_barrier_names_a_node_of_another_contract():
    barrier = Barrier(CODEC)
    barrier.hear(heartbeat(contract_hash=0xDEADBEEF))
    assert barrier.foreign
    assert barrier.explain() == barrier.wrong()
    assert barrier.wrong() == (
        f"FLIGHT speaks contract 0xDEADBEEF, this bench 0x{CODEC.hash:08X} (4 receivers)"
    )
    barrier.hear(heartbeat())
    assert (barrier.foreign, barrier.wrong(), barrier.missing) == (False, "", ())


@pytest.mark.parametrize(
    ("spoken", "words"),
    [
        (codec(2).hash, f"0x{codec(2).hash:08X} (2 receivers)"),
        (int.from_bytes(CODEC.hash.to_bytes(4, "big"), "little"), "(its bytes in another order)"),
    ],
)
def test_a_contract_that_is_known_is_named(spoken, words):
    barrier = Barrier(CODEC)
    barrier.hear(heartbeat(contract_hash=spoken))
    assert words in barrier.wrong()


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        (lambda: changed(heartbeat(), bits=1), "the heartbeat of FLIGHT is corrupted: CRC "),
        (lambda: batch(heartbeat().can_id, b"\x01\x02"), "the heartbeat of FLIGHT is of 2 bytes, not 8"),
    ],
)
def test_a_damaged_heartbeat_is_told_as_that(frames, words):
    barrier = Barrier(CODEC)
    barrier.hear(frames())
    assert barrier.wrong().startswith(words) and not barrier.foreign
    assert barrier.explain() == barrier.wrong()


def changed(frames: FrameBatch, flag: int = 0, bits: int = 0) -> FrameBatch:
    """With a flag on the identifier, or with bits of the first byte flipped."""
    data = frames.data.copy()
    data[:, 0] ^= bits
    return FrameBatch(frames.t_ns, frames.can_id | np.uint32(flag), frames.length, data)


@pytest.mark.parametrize(
    "frames",
    [
        changed(heartbeat(), bits=1),
        changed(heartbeat(), flag=ERR_FLAG),
        batch(heartbeat().can_id, b"\x01\x02"),
        batch([0x7FF], b"12345678"),
        EMPTY,
    ],
    ids=["bad CRC", "error frame", "short", "unknown identifier", "silence"],
)
def test_barrier_is_not_opened_by_anything_else(frames):
    barrier = Barrier(CODEC)
    barrier.hear(frames)
    assert barrier.missing == (FLIGHT_NODE,)


def exchange(**more) -> Exchange:
    return Exchange(CODEC, SESSION, {FLIGHT_NODE: heartbeat().data[0].tobytes()}, **more)


def test_an_epoch_is_the_block_closed_by_sync():
    assert exchange().open(4, block(4)) == concat((block(4), sync(4, 6)))


def test_the_answer_is_what_came_before_done():
    e = exchange()
    e.open(0, block(0))
    assert not e.hear(navigation(0))
    assert e.hear(done(0, 3))
    assert e.inbox() == navigation(0)
    assert e.lost == 0


def test_answers_of_other_epochs_and_sessions_are_ignored():
    e = exchange()
    e.open(5, block(5))
    assert not e.hear(concat((navigation(4), done(4, 3), navigation(5), done(5, 3, session=8))))
    assert e.hear(concat((navigation(5), done(5, 3))))
    assert e.inbox() == navigation(5)


def test_an_answer_given_twice_counts_once():
    e = exchange()
    e.open(5, block(5))
    assert e.repeat() == sync(5, 6)
    e.hear(concat((navigation(5), done(5, 3))))
    assert e.inbox() == navigation(5)
    e.open(6, block(6))
    assert not e.hear(concat((navigation(5), done(5, 3))))
    assert e.hear(concat((navigation(6), done(6, 3))))
    assert e.inbox() == navigation(6)


def test_the_first_answer_stands_where_the_second_lost_a_frame():
    e = exchange()
    e.open(5, block(5))
    e.hear(concat((navigation(5), done(5, 3))))
    e.hear(concat((navigation(5)[:2], done(5, 3))))
    assert e.inbox() == navigation(5)
    assert e.lost == 0


def test_when_done_was_lost_the_repeated_answer_stands_alone():
    e = exchange()
    e.open(5, block(5))
    e.hear(navigation(5))  # its DONE did not arrive
    e.repeat()
    assert e.hear(concat((navigation(5), done(5, 3))))
    assert e.inbox() == navigation(5)
    assert e.lost == 0


@pytest.mark.parametrize("waiting", [0, 1, 4])
def test_heartbeats_from_before_the_start_reach_no_epoch(waiting):
    e = exchange()
    e.open(0, block(0))
    answer = concat((navigation(0), heartbeat()))  # a node may say the same again in its block
    assert e.hear(concat((*[heartbeat()] * waiting, answer, done(0, 4))))
    assert e.inbox() == answer


def test_missing_frames_are_counted():
    e = exchange()
    e.open(0, block(0))
    e.hear(concat((navigation(0, 2), done(0, 5))))
    assert e.lost == 3
    assert e.inbox() == navigation(0, 2)


def test_frames_of_others_come_after_the_nodes():
    e = exchange()
    e.open(0, block(0))
    stranger, error = batch([0x555], b"x"), batch([0x40 | ERR_FLAG], b"12345678")
    e.hear(concat((stranger, navigation(0), error, done(0, 3))))
    assert e.inbox() == concat((navigation(0), stranger, error))
    assert e.inbox() == navigation(0)


def test_free_running_keeps_what_came_late():
    e = exchange(keep_late=True)
    e.open(5, block(5))
    e.everything()
    e.open(6, block(6))
    assert not e.hear(concat((navigation(5), done(5, 3), navigation(6))))
    assert sorted(e.everything().data[:, 0].tolist()) == [5, 5, 5, 6, 6, 6]
    assert e.everything() == EMPTY


def sealed_anew(frame: FrameBatch, row: bytes) -> FrameBatch:
    """With other bytes from byte 1 on, and the CRC that belongs to them."""
    data = np.frombuffer(b"\0" + row, np.uint8)[None, :].copy()
    data[:, 0] = e2e.crc(frame.can_id, data)
    return FrameBatch(frame.t_ns, frame.can_id, frame.length, data)


BENCH = done(5, 3)
BYTES = BENCH.data[0].tobytes()


@pytest.mark.parametrize(
    ("frame", "refusal"),
    [
        (batch(0x7D5, BYTES), Refusal.UNKNOWN),
        (batch(messages.DONE_ID, b""), Refusal.WRONG_LENGTH),
        (batch(messages.DONE_ID, BYTES[:7]), Refusal.WRONG_LENGTH),
        (changed(BENCH, bits=1), Refusal.CORRUPTED),
        (batch(messages.DONE_ID, bytes.fromhex("023E800000000000")), Refusal.CORRUPTED),
        (sealed_anew(BENCH, bytes([BYTES[1] | 0x0F]) + BYTES[2:]), Refusal.CORRUPTED),
        (sealed_anew(BENCH, bytes([BYTES[1] ^ 0x10]) + BYTES[2:]), Refusal.CORRUPTED),
        (done(5, 3, session=SESSION + 1), Refusal.OTHER_SESSION),
        (sync(3, 3), Refusal.OTHER_EPOCH),
        (done(7, 3), Refusal.OTHER_EPOCH),
        (done(30_000, 3), Refusal.OTHER_EPOCH),
    ],
    ids=["unknown", "empty", "short", "CRC", "UDS", "counter 15", "nibble", "session", "-2", "+2", "far"],
)
def test_a_bench_frame_is_believed_by_one_rule(frame, refusal):
    assert messages.judge(frame, 0, SESSION, 5) is refusal
    e = exchange()
    e.open(5, block(5))
    assert not e.hear(concat((navigation(5)[:1], frame, navigation(5)[1:])))
    assert e.refused == {refusal: 1}
    assert e.hear(done(5, 3))
    assert (e.inbox(), e.lost, e.late) == (navigation(5), 0, 0)


@pytest.mark.parametrize("epoch", [0, 5, 65_535, 65_536, 1_000_000])
@pytest.mark.parametrize("ahead", [-1, 0, 1])
def test_the_epoch_is_that_beside_the_expected_one(epoch, ahead):
    expected = epoch - ahead
    found = messages.judge(done(epoch, 3), 0, SESSION, max(expected, 0))
    assert found == Bench(messages.DONE_ID, SESSION, epoch, 3)


def test_before_the_first_epoch_there_is_none():
    assert messages.judge(done(65_535, 3), 0, SESSION, 0) is Refusal.OTHER_EPOCH


@pytest.mark.parametrize("frame", [sync(5, 3), done(6, 3)], ids=["another master", "the next epoch"])
def test_what_is_out_of_turn_closes_nothing(frame):
    e = exchange()
    e.open(5, block(5))
    assert not e.hear(concat((navigation(5), frame)))
    assert e.refused == {Refusal.OUT_OF_TURN: 1}
    assert e.hear(done(5, 3)) and e.inbox() == navigation(5)


def test_a_late_answer_is_told_as_late_and_taken_for_nothing():
    e = exchange()
    e.open(4, block(4))
    e.open(5, block(5))
    assert not e.hear(concat((navigation(4), done(4, 3))))
    assert e.hear(concat((navigation(5), done(5, 3))))
    assert (e.inbox(), e.late) == (navigation(5), 1)


def test_refusals_are_told_with_their_reasons():
    e = exchange()
    e.open(5, block(5))
    e.hear(concat((done(9, 3), done(9, 3), done(5, 3, session=1))))
    assert messages.explain(e.refused) == "3 bench frames refused: 2 of another epoch, 1 of another session"
    assert messages.explain({}) == ""


@pytest.mark.parametrize("behind", [2, 3, 4, 15, 16, 17, 40])
@pytest.mark.parametrize("keep_late", [False, True], ids=["lockstep", "at a pace"])
def test_an_answer_some_epochs_late_is_told_and_at_a_pace_heard_while_commands_may_count(behind, keep_late):
    """Sixteen epochs late its frames look like those of the open epoch."""
    e = exchange(keep_late=keep_late)
    e.open(0, block(0))
    e.hear(concat((navigation(0), done(0, 3))))
    assert (e.everything() if keep_late else e.inbox()) == navigation(0)
    for k in range(1, 101):
        e.open(k, block(k))
    late = 100 - behind
    assert not e.hear(concat((navigation(late), done(late, 3))))
    assert (e.late, e.refused) == (1, {})
    if keep_late:
        assert e.everything() == (navigation(late) if behind <= 3 else EMPTY)
    assert e.hear(concat((navigation(100), done(100, 3))))
    assert (e.everything() if keep_late else e.inbox()) == navigation(100)


def test_at_a_pace_what_is_not_closed_waits_for_its_done():
    e = exchange(keep_late=True)
    e.open(0, block(0))
    assert e.everything() == EMPTY
    e.hear(navigation(0)[:2])
    assert e.everything() == navigation(0)[:2], "who never closed an answer may know no bench frames"
    e.hear(concat((navigation(0)[2:], done(0, 1))))
    assert e.everything() == navigation(0)[2:]
    e.open(1, block(1))
    e.hear(navigation(1))
    assert e.everything() == EMPTY
    e.hear(done(1, 3))
    assert e.everything() == navigation(1)
