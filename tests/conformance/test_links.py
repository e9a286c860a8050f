"""What `gnss_hil.dbc.bus.base.Link` promises, on every bus."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from gnss_hil.dbc.bus.base import LinkClosed
from gnss_hil.dbc.contract.frames import EFF_FLAG, EMPTY, ERR_FLAG, RTR_FLAG, FrameBatch, batch, concat
from tests.support.waiting import HANG_S, pause

pytestmark = pytest.mark.verifies(what="The embedded bus")


def numbered(n: int, can_id: int = 0x100, first: int = 0) -> FrameBatch:
    """n frames whose payloads count up."""
    payload = np.arange(first, first + n, dtype="<u8").view(np.uint8).reshape(-1, 8)
    return batch(np.full(n, can_id), payload)


def numbers(frames: FrameBatch) -> list[int]:
    return np.ascontiguousarray(frames.data).view("<u8")[:, 0].tolist()


def gather(link, n: int, timeout_s: float = HANG_S) -> FrameBatch:
    """n frames, or what came before `timeout_s` passed."""
    pieces, count, end_s = [], 0, time.monotonic() + timeout_s
    while count < n and (rest_s := end_s - time.monotonic()) > 0:
        pieces.append(link.receive(rest_s))
        count += len(pieces[-1])
    return concat(pieces)


def assert_same(heard: FrameBatch, sent: FrameBatch) -> None:
    """Equal but for the times, which a bus does not carry."""
    for name in ("can_id", "length", "data"):
        assert np.array_equal(getattr(heard, name), getattr(sent, name)), name


ODD_FRAMES = {
    "empty": batch([0x123], b""),
    "three bytes": batch([0x123], b"\x01\x02\x03"),
    "highest base identifier": batch([0x7FF], b"12345678"),
    "extended": batch([0x1ABCDEF0 | EFF_FLAG], b"12345678"),
    "extended with a small identifier": batch([0x123 | EFF_FLAG], b"1"),
    "remote": batch([0x321 | RTR_FLAG], b"", length=5),
    "error": batch([0x04 | ERR_FLAG], b"\x00\x0c\x00\x00\x00\x00\x60\x60"),
}


@pytest.mark.parametrize("kind", ODD_FRAMES)
def test_frames_arrive_as_they_were_sent(join, kind):
    sender, receiver = join(), join()
    sender.send(ODD_FRAMES[kind])
    sender.send(numbered(1))
    assert_same(gather(receiver, 2), concat((ODD_FRAMES[kind], numbered(1))))


def test_order_holds_within_and_between_batches(join):
    sender, receiver = join(), join()
    sent = [numbered(n, 0x100 + n) for n in (1, 2, 330, 1, 50)]
    for frames in sent:
        sender.send(frames)
    assert_same(gather(receiver, 384), concat(sent))


def test_a_sender_never_hears_itself(join):
    sender, other = join(), join()
    sender.send(numbered(5))
    assert len(gather(other, 5)) == 5
    other.send(numbered(1, first=77))
    assert numbers(gather(sender, 1)) == [77]
    assert sender.receive(0) == EMPTY


def test_every_other_node_hears_everything(join):
    sender, *others = (join() for _ in range(4))
    sender.send(numbered(100))
    for other in others:
        assert numbers(gather(other, 100)) == list(range(100))


def test_two_senders_keep_their_order_and_are_heard_in_one(bus, join):
    a, b, first, second = (join() for _ in range(4))
    rounds = min(bus.volume, 2000) // 10

    def talk(link, can_id):
        for k in range(rounds):
            link.send(numbered(5, can_id, 5 * k))

    threads = [threading.Thread(target=talk, args=a_b) for a_b in ((a, 0x10), (b, 0x20))]
    for thread in threads:
        thread.start()
    heard = gather(first, 10 * rounds)
    for thread in threads:
        thread.join()
    heard_too = gather(second, 10 * rounds)
    if bus.one_order:
        assert_same(heard_too, heard)
    for frames in (heard, heard_too):
        for can_id in (0x10, 0x20):
            assert numbers(frames[frames.can_id == can_id]) == list(range(5 * rounds))
    assert first.dropped == second.dropped == 0


def test_a_slow_receiver_loses_nothing_or_tells(bus, join):
    """Nothing is read until the sender is done, or held back for a while."""
    sender, receiver = join(), join()
    frames = numbered(1000)
    rounds = bus.volume // 1000 or 1

    def talk():
        for _ in range(rounds):
            sender.send(frames)

    thread = threading.Thread(target=talk)
    thread.start()
    pause(0.3)
    heard = gather(receiver, 1000 * rounds, HANG_S if bus.lossless else 2.0)
    thread.join()
    if bus.lossless:
        assert numbers(heard) == list(range(1000)) * rounds
        assert receiver.dropped == 0
    else:
        assert numbers(heard) == (list(range(1000)) * rounds)[: len(heard)]
        assert len(heard) + receiver.dropped == 1000 * rounds or not hasattr(receiver, "receive_buffer_bytes")


def test_silence_gives_an_empty_batch_after_the_time_asked_for(join):
    link = join()
    join()
    assert link.receive(0) == EMPTY
    begun_s = time.monotonic()
    assert link.receive(0.2) == EMPTY
    assert time.monotonic() - begun_s > 0.19


def test_receive_waits_for_what_comes_later(join):
    sender, receiver = join(), join()
    timer = threading.Timer(0.2, sender.send, [numbered(3)])
    timer.start()
    assert numbers(gather(receiver, 3)) == [0, 1, 2]
    timer.join()


def test_nothing_to_send_is_no_frame(join):
    sender, receiver = join(), join()
    sender.send(EMPTY)
    assert receiver.receive(0.05) == EMPTY


def test_a_closed_link_says_so(join):
    link = join()
    link.close()
    link.close()
    with pytest.raises(LinkClosed):
        link.send(numbered(1))
    with pytest.raises(LinkClosed):
        link.receive(0)


def test_one_that_leaves_does_not_disturb_the_others(join):
    stays, leaves, listens = join(), join(), join()
    leaves.send(numbered(2))
    leaves.close()
    stays.send(numbered(2, first=2))
    assert sorted(numbers(gather(listens, 4))) == [0, 1, 2, 3]


def test_the_end_of_the_bus_is_told(bus, join):
    if bus.end is None:
        pytest.skip("nothing can take this bus away")
    link, other = join(), join()
    other.send(numbered(1))
    assert len(gather(link, 1)) == 1
    bus.end()
    with pytest.raises(LinkClosed):
        for _ in range(100):
            link.receive(0.05)
