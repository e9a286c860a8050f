"""What only the embedded bus promises: privacy, back-pressure, a recorder's place, C programs."""

from __future__ import annotations

import os
import resource
import socket
import stat
import struct
import subprocess
import threading
import time
from contextlib import suppress
from pathlib import Path

import can
import numpy as np
import pytest

from gnss_hil.dbc.bus.base import LinkClosed, LinkError
from gnss_hil.dbc.bus.hub import ACCEPT_AGAIN_S, QUEUE_BYTES, Hub
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.contract.frames import batch, from_wire, to_wire
from tests.conformance.test_links import assert_same, gather, numbered, numbers
from tests.support.outside import c_tools
from tests.support.waiting import HANG_S, ended, finished, until

KERNEL_BUFFERS_BYTES = 4 << 20  # generous for what two stream sockets hold


@pytest.fixture
def folder():
    with RuntimeDir() as path:
        yield path


@pytest.fixture
def hub(folder):
    with Hub(folder / "bus.sock") as hub:
        yield hub


def join(hub):
    return open_link(f"embedded:{hub.path}")


def raw(hub) -> socket.socket:
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    sock.connect(str(hub.path))
    sock.settimeout(HANG_S)
    return sock


def test_nobody_else_can_reach_the_socket(hub, folder):
    assert stat.S_IMODE(hub.path.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_socket_and_folder_are_gone_afterwards():
    with RuntimeDir() as folder, Hub(folder / "bus.sock") as hub:
        assert hub.path.exists()
    assert not folder.exists()


@pytest.mark.parametrize(
    ("path", "reason"),
    [("/nowhere/at/all.sock", "No such file or directory"), ("/tmp/" + "x" * 120, "longer than 107 bytes")],
)
def test_a_hub_that_cannot_be_says_why(path, reason):
    with pytest.raises(LinkError, match=reason):
        Hub(Path(path))


def test_a_link_to_nowhere_says_so(folder):
    with pytest.raises(LinkError, match="No such file or directory"):
        open_link(f"embedded:{folder / 'none.sock'}")


def test_the_wire_is_struct_can_frame(hub):
    link, sock = join(hub), raw(hub)
    link.send(batch([0x123], b"\x01\x02\x03"))
    assert sock.recv(16, socket.MSG_WAITALL) == struct.pack("=IB3x8s", 0x123, 3, b"\x01\x02\x03")
    sock.sendall(struct.pack("=IB3x8s", 0x7FF, 8, b"abcdefgh"))
    assert_same(gather(link, 1), batch([0x7FF], b"abcdefgh"))
    link.close()
    sock.close()


def test_frames_may_come_in_any_pieces(hub):
    link, sock = join(hub), raw(hub)
    wire = to_wire(numbered(40))
    for start in range(0, len(wire), 7):
        sock.sendall(wire[start : start + 7])
    assert numbers(gather(link, 40)) == list(range(40))
    link.close()
    sock.close()


def test_what_is_no_frame_goes_no_further(hub):
    """A length above eight bytes, and the beginning of a frame that its sender never ended."""
    link, sock = join(hub), raw(hub)
    sock.sendall(struct.pack("=IB3x8s", 1, 9, b"") + to_wire(numbered(1)) + b"half")
    sock.close()
    assert numbers(gather(link, 1)) == [0]
    until(lambda: hub.malformed == 2)
    assert len(link.receive(0.05)) == 0
    link.close()


def test_bytes_beyond_the_length_are_nobodys_business(hub):
    link, sock = join(hub), raw(hub)
    sock.sendall(struct.pack("=IB3x8s", 0x10, 2, b"\x01\x02garbag"))
    assert_same(gather(link, 1), batch([0x10], b"\x01\x02"))
    link.close()
    sock.close()


def test_the_tap_sees_all_frames_in_the_receivers_order(folder):
    seen = []
    with Hub(folder / "bus.sock", [lambda number, wire: seen.append((number, wire))]) as hub:
        a, b, listener = join(hub), join(hub), join(hub)

        def talk(link, can_id):
            for k in range(50):
                link.send(numbered(10, can_id, 10 * k))

        threads = [threading.Thread(target=talk, args=which) for which in ((a, 1), (b, 2))]
        for thread in threads:
            thread.start()
        heard = gather(listener, 1000)
        for thread in threads:
            thread.join()
        until(lambda: sum(len(wire) for _, wire in seen) == 16_000)
        for link in (a, b, listener):
            link.close()
    assert_same(from_wire(b"".join(wire for _, wire in seen)), heard)
    assert {number for number, _ in seen} == {1, 2}
    for number, wire in seen:
        assert (from_wire(wire).can_id == number).all()


def test_comings_and_goings_are_told(folder):
    seen = []
    with Hub(folder / "bus.sock", watch=lambda number, here: seen.append((number, here))) as hub:
        first, second = join(hub), join(hub)
        until(lambda: seen == [(1, True), (2, True)])
        first.close()
        until(lambda: seen[2:] == [(1, False)])
        second.close()
        until(lambda: hub.peers == 0)


def test_a_tap_that_fails_ends_the_bus_and_is_reported(folder):
    def tap(number, wire):
        raise OSError("disk full")

    with Hub(folder / "bus.sock", [tap]) as hub:
        link = join(hub)
        link.send(numbered(1))
        with pytest.raises(LinkClosed):
            for _ in range(100):
                link.receive(0.05)
        assert isinstance(hub.failure, OSError)
        link.close()


def test_a_receiver_that_does_not_read_holds_the_sender_back(hub):
    """Memory is bounded: what the sender got rid of is in the hub's queue and the kernel's buffers."""
    sleeper, sender = raw(hub), raw(hub)
    sender.settimeout(0.3)
    wire, sent = to_wire(numbered(1000)), 0
    with pytest.raises(TimeoutError):
        while sent < 100 * QUEUE_BYTES:
            sent += sender.send(wire)
    assert sent < QUEUE_BYTES + KERNEL_BUFFERS_BYTES
    sleeper.settimeout(HANG_S)
    received = 0
    while received < sent:
        received += len(sleeper.recv(1 << 16))
    assert received == sent
    sleeper.close()
    sender.close()


def test_a_sleeper_that_dies_lets_the_others_go_on(hub):
    sleeper, sender = raw(hub), join(hub)
    thread = threading.Thread(target=lambda: [sender.send(numbered(1000)) for _ in range(300)])
    thread.start()
    until(lambda: hub.holding_back(0))
    assert thread.is_alive()
    sleeper.close()
    finished(thread)
    sender.close()


def test_a_pure_sender_may_close_its_ears(hub):
    """shutdown(SHUT_RD): its own queue never fills, and it is still heard."""
    deaf, talker, listener = raw(hub), join(hub), join(hub)
    deaf.shutdown(socket.SHUT_RD)
    reader = threading.Thread(target=lambda: gather(listener, 200_000))
    reader.start()
    for _ in range(200):
        talker.send(numbered(1000))
    finished(reader)
    deaf.sendall(to_wire(numbered(1, 0x555)))
    assert gather(listener, 1).can_id.tolist() == [0x555]
    for node in (deaf, talker, listener):
        node.close()


def test_two_nodes_that_flood_each_other_get_through(hub):
    a, b = join(hub), join(hub)
    heard = {}

    def talk(link, name):
        for _ in range(100):
            link.send(numbered(1000))
        heard[name] = gather(link, 100_000)

    threads = [threading.Thread(target=talk, args=which) for which in ((a, "a"), (b, "b"))]
    for thread in threads:
        thread.start()
    for thread in threads:
        finished(thread)
    for name in "ab":
        assert numbers(heard[name]) == list(range(1000)) * 100
    a.close()
    b.close()


@pytest.mark.verifies(what="The embedded bus")
def test_pythoncan_api_keeps_its_promises(hub):
    """Filters, iteration timeouts and errors as python-can documents them."""
    with (
        can.Bus(interface="gnss-hil", channel=str(hub.path)) as sender,
        can.Bus(
            interface="gnss-hil", channel=str(hub.path), can_filters=[{"can_id": 0x20, "can_mask": 0x7FF}]
        ) as receiver,
    ):
        begun_s = time.time()
        for arbitration_id in (0x10, 0x20, 0x30):
            sender.send(can.Message(arbitration_id=arbitration_id, is_extended_id=False, data=[1, 2]))
        message = receiver.recv(HANG_S)
        assert (message.arbitration_id, bytes(message.data), message.dlc) == (0x20, b"\x01\x02", 2)
        assert begun_s <= message.timestamp <= time.time()
        assert receiver.recv(0.05) is None
        with pytest.raises(can.CanOperationError, match="classical"):
            sender.send(can.Message(is_fd=True, data=bytes(12)))
        hub.close()
        with pytest.raises(can.CanOperationError):
            for _ in range(100):
                receiver.recv(0.05)
    with pytest.raises(can.CanInitializationError, match="no bench is running there"):
        can.Bus(interface="gnss-hil", channel=str(hub.path))


def test_a_sender_held_back_may_give_up(hub):
    sleeper, filler = raw(hub), join(hub)
    for _ in range(QUEUE_BYTES // 16_000 - 2):
        filler.send(numbered(1000))
    filler.close()
    with can.Bus(interface="gnss-hil", channel=str(hub.path)) as sender:
        message = can.Message(arbitration_id=1, is_extended_id=False, data=bytes(8))
        with pytest.raises(can.CanOperationError, match="holds this sender back"):
            for _ in range(KERNEL_BUFFERS_BYTES // 16):
                sender.send(message, timeout=0.1)
    sleeper.close()


@pytest.mark.verifies(
    "dbc/contract/frames.py",
    "dbc/common/satellites.py",
    what="Frame batches, wire form",
    by="`struct can_frame` of linux/can.h; a C program on the embedded bus",
    status="validated",
)
@pytest.mark.verifies(
    "dbc/bus/base.py",
    "dbc/bus/open_link.py",
    "dbc/bus/inline.py",
    "dbc/bus/embedded.py",
    "dbc/bus/hub.py",
    "dbc/bus/hub_peer.py",
    "dbc/bus/hub_socket.py",
    "dbc/bus/plugin.py",
    "dbc/bus/runtime_dir.py",
    what="The embedded bus",
    by=(
        "a C program with connect, read and write; filters, timeouts and errors as python-can documents "
        "them; one suite of promises for every bus"
    ),
    status="validated",
)
def test_a_c_program_joins_with_connect_read_and_write(hub, tmp_path):
    c_tools("cc")
    program = tmp_path / "client"
    source = Path(__file__).with_name("client.c")
    subprocess.run(["cc", "-Wall", "-Wextra", "-Werror", "-O2", "-o", program, source], check=True)
    client = subprocess.Popen([program, hub.path], stdout=subprocess.PIPE, text=True)
    assert client.stdout.readline() == "ready\n"
    link = join(hub)
    sent = numbered(1000, 0x200)
    link.send(sent)
    heard = gather(link, 1000)
    assert np.array_equal(heard.data, sent.data)
    assert (heard.can_id == 0x201).all()
    link.close()
    hub.close()
    assert ended(client)[0] == "1000\n"
    assert client.returncode == 0


def test_a_peer_that_never_reads_is_named_once_it_held_back_long_enough(hub):
    deaf, link, sock = raw(hub), join(hub), raw(hub)
    sock.setblocking(False)
    assert hub.holding_back(0) == []
    wire = memoryview(to_wire(numbered((QUEUE_BYTES + KERNEL_BUFFERS_BYTES) // 16)))
    gone = threading.Event()

    def hear():
        with suppress(LinkClosed):
            while not gone.is_set():
                link.receive(0.05)

    reader = threading.Thread(target=hear)
    reader.start()

    def held():
        nonlocal wire
        with suppress(BlockingIOError):
            wire = wire[sock.send(wire) :]
        return hub.holding_back(0)

    until(held)
    assert hub.holding_back(0) == [(1, os.getpid())]
    assert hub.holding_back(HANG_S) == []
    deaf.close()
    until(lambda: hub.holding_back(0) == [])
    gone.set()
    reader.join()
    link.close()
    sock.close()


class Turns:
    """A selector that keeps what a hub waited for, turn by turn: how long at most, how many it found."""

    def __init__(self, selector):
        self._selector, self.seen = selector, []

    def __getattr__(self, name):
        return getattr(self._selector, name)

    def select(self, timeout):
        found = self._selector.select(timeout)
        self.seen.append((timeout, len(found)))
        return found


def test_without_a_file_descriptor_the_hub_rests_and_who_connects_waits(hub):
    """Between two looks at who waits it sleeps, and nothing wakes it."""
    turns = hub._selector = Turns(hub._selector)
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    late = socket.socket(socket.AF_UNIX)
    held = [os.dup(0)]
    resource.setrlimit(resource.RLIMIT_NOFILE, (held[0] + 8, limits[1]))
    try:
        with suppress(OSError):
            while True:
                held.append(os.dup(0))
        late.connect(str(hub.path))
        until(lambda: len(turns.seen) >= 6)
        assert turns.seen[:6] == 3 * [(ACCEPT_AGAIN_S, 0), (None, 1)], "the hub spins"
        assert hub.peers == 0
    finally:
        for descriptor in held:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
    until(lambda: hub.peers == 1)
    late.close()
