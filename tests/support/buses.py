"""The buses that must all behave alike, each with a way to join it and to take it away."""

from __future__ import annotations

import subprocess
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import can

from gnss_hil.dbc.bus.base import Link
from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.inline import InlineBus
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.bus.pythoncan import PythonCanLink, connect
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir


@dataclass(frozen=True, slots=True)
class Offer:
    """A bus in one test.

    join      a new link on it
    end       takes the bus away from under its links; None where nothing can
    lossless  holds senders back instead of losing frames
    volume    frames for the bulk tests: python-can carries them one object at a time
    one_order all receivers hear the frames of all senders in the same order
    """

    join: Callable[[], Link]
    end: Callable[[], None] | None
    lossless: bool
    volume: int
    one_order: bool = True


@contextmanager
def inline() -> Iterator[Offer]:
    bus = InlineBus()
    yield Offer(bus.connect, bus.close, lossless=True, volume=100_000)
    bus.close()


@contextmanager
def embedded() -> Iterator[Offer]:
    with RuntimeDir() as folder, Hub(folder / "bus.sock") as hub:
        yield Offer(
            lambda: open_link(f"embedded:{folder / 'bus.sock'}"), hub.close, lossless=True, volume=100_000
        )
        assert hub.failure is None


@contextmanager
def plugin() -> Iterator[Offer]:
    """The embedded bus through python-can's API, found by its entry point."""
    with RuntimeDir() as folder, Hub(folder / "bus.sock") as hub:
        yield Offer(
            lambda: connect("gnss-hil", str(folder / "bus.sock")), hub.close, lossless=True, volume=10_000
        )


@contextmanager
def virtual() -> Iterator[Offer]:
    """python-can's bus within one process; it fills its receivers' queues without a lock."""
    channel = uuid.uuid4().hex
    yield Offer(lambda: open_link(f"virtual:{channel}"), None, lossless=True, volume=10_000, one_order=False)


def _vcan1_down() -> None:
    subprocess.run(["ip", "link", "set", "vcan1", "down"], check=True)


@contextmanager
def socketcan() -> Iterator[Offer]:
    subprocess.run(["ip", "link", "set", "vcan1", "up"], check=True)
    yield Offer(lambda: open_link("socketcan:vcan1"), _vcan1_down, lossless=False, volume=5_000)


@contextmanager
def socketcan_by_pythoncan() -> Iterator[Offer]:
    subprocess.run(["ip", "link", "set", "vcan1", "up"], check=True)

    def join() -> Link:
        return PythonCanLink(can.Bus(interface="socketcan", channel="vcan1"))

    yield Offer(join, _vcan1_down, lossless=False, volume=200)


BUSES = {f.__name__: f for f in (inline, embedded, plugin, virtual, socketcan, socketcan_by_pythoncan)}
ON_KERNEL = {"socketcan", "socketcan_by_pythoncan"}
