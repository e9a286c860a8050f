"""Each conformance test runs on every bus; those of the kernel where it has CAN."""

from __future__ import annotations

import socket
from contextlib import ExitStack

import pytest

from tests.support.buses import BUSES, ON_KERNEL


def kernel_has_vcan() -> bool:
    return "vcan1" in {name for _, name in socket.if_nameindex()}


# Without vcan the kernel's buses are left out here; tests/system/test_socketcan.py runs them in user-mode
# Linux, and says loudly if it cannot.
PARAMETERS = [
    pytest.param(name, marks=[pytest.mark.socketcan] if name in ON_KERNEL else [])
    for name in BUSES
    if name not in ON_KERNEL or kernel_has_vcan()
]


@pytest.fixture(params=PARAMETERS)
def bus(request):
    with BUSES[request.param]() as offer:
        yield offer


@pytest.fixture
def join(bus):
    """Joins the bus; every link is closed at the end."""
    with ExitStack() as stack:

        def joined():
            link = bus.join()
            stack.callback(link.close)
            return link

        yield joined
