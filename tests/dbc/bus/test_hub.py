"""Who hears what of a bus: no race between a connection and the bytes that are sent after it."""

from __future__ import annotations

import os
import queue
import stat
import threading

import numpy as np
import pytest

from gnss_hil.dbc.bus.base import LinkError
from gnss_hil.dbc.bus.embedded import connect
from gnss_hil.dbc.bus.hub import HELD_BACK_S, LOOK_S, Hub
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.contract.frames import batch
from tests.support.waiting import HANG_S, finished, pause, until


class Gate:
    """A tap that says which peer's bytes it has, and holds the hub's thread until it is opened."""

    def __init__(self):
        self._here: queue.Queue[int] = queue.Queue()
        self._open: queue.Queue[None] = queue.Queue()

    def __call__(self, sender: int, wire: bytes) -> None:
        self._here.put(sender)
        self._open.get(timeout=HANG_S)

    def held(self) -> int:
        return self._here.get(timeout=HANG_S)

    def open(self) -> None:
        self._open.put(None)


def frame(can_id):
    return batch(can_id, np.zeros(8, np.uint8))


def test_a_peer_that_connected_before_bytes_were_sent_receives_them():
    """The hub is held between its select, which names two readable peers, and its reading of the second.

    Then a third connects, and the second sends more: the hub must know the third when it reads that.
    """
    gate = Gate()
    with RuntimeDir() as folder, Hub(folder / "can0", taps=(gate,)) as hub:
        peers = {}
        for number in (1, 2):
            peers[number] = connect(str(hub.path))
            until(lambda number=number: hub.peers == number)
        peers[1].send(frame(0x101))
        gate.held()
        peers[1].send(frame(0x102))
        peers[2].send(frame(0x103))
        gate.open()
        first = gate.held()
        third = connect(str(hub.path))
        second = peers[3 - first]
        second.send(frame(0x200))
        gate.open()
        assert gate.held() == 3 - first
        gate.open()
        until(lambda: hub.peers == 3)
        second.send(frame(0x300))
        gate.held()
        gate.open()
        heard = []
        while not heard or heard[-1] != 0x300:
            frames = third.receive(HANG_S)
            assert len(frames)
            heard += frames.can_id.tolist()
        assert 0x200 in heard
        for link in (*peers.values(), third):
            link.close()


class Clock:
    """Seconds as the test has them."""

    def __init__(self):
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def test_a_peer_that_never_reads_is_dropped_and_the_others_go_on():
    clock, heard = Clock(), []
    many = batch(np.full(4096, 0x100), np.zeros((4096, 8), np.uint8))
    with RuntimeDir() as folder, Hub(folder / "can0", (lambda *_: heard.append(1),), clock=clock) as hub:
        sender, deaf = connect(str(hub.path)), connect(str(hub.path))
        until(lambda: hub.peers == 2)
        speaking = threading.Thread(target=lambda: [sender.send(many) for _ in range(60)], daemon=True)
        speaking.start()
        until(lambda: hub.holding_back(0.0))
        clock.now_s += HELD_BACK_S - 1
        pause(3 * LOOK_S)
        assert (hub.peers, hub.dropped) == (2, [])
        assert [number for number, _ in hub.holding_back(HELD_BACK_S - 1)] == [2]
        clock.now_s += 1
        until(lambda: hub.dropped)
        finished(speaking)
        assert hub.dropped == [(2, os.getpid())] and hub.peers == 1
        sender.send(frame(0x123))
        deaf.close()
        sender.close()
    assert heard


def test_a_hub_removes_its_own_socket_and_no_other(tmp_path):
    path = tmp_path / "bus"
    with Hub(path) as hub:
        assert stat.S_IMODE(path.stat().st_mode) == 0o600 and hub.reachable
    assert not path.exists()
    with Hub(path) as first:
        path.unlink()
        assert not first.reachable
        second = Hub(path)
        assert second.reachable and not first.reachable
        first.close()
        assert second.reachable
        connect(str(path)).close()
        second.close()
    assert not path.exists()


def test_what_lies_where_the_socket_is_to_be_stays_and_is_told(tmp_path):
    path = tmp_path / "bus"
    path.write_text("mine")
    with pytest.raises(LinkError, match="something else than a socket is there"):
        Hub(path)
    assert path.read_text() == "mine"
    path.unlink()
    with Hub(path), pytest.raises(LinkError, match="another process serves it"):
        Hub(path)


def test_a_bus_of_another_user_is_not_joined(tmp_path, monkeypatch):
    with Hub(tmp_path / "bus") as hub:
        me = os.getuid()
        monkeypatch.setattr(os, "getuid", lambda: me + 1)
        with pytest.raises(LinkError, match=f"user {me} serves it, not you \\(user {me + 1}\\)"):
            connect(str(hub.path))
        monkeypatch.undo()
        connect(str(hub.path)).close()
