"""On a kernel with CAN: the emulator of examples/receiver_py against our flight software on vcan0.

`tests/system/test_socketcan.py` runs this in user-mode Linux where the machine's own kernel has no CAN.
"""

from __future__ import annotations

import csv
import math
import socket
import subprocess
from pathlib import Path

import pytest

from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import FrameBatch, concat
from tests.support.programs import FLIGHT
from tests.support.receiver_py import VEHICLE, start
from tests.support.waiting import exit_status

EPOCHS = 60
AGREEMENT_M = 0.01
SPEC = "socketcan:vcan0"
KINDS = "TIME_MARK", "NAV_X", "NAV_Y", "NAV_Z"

pytestmark = pytest.mark.socketcan

if "vcan0" not in {name for _, name in socket.if_nameindex()}:
    pytest.skip("no vcan0 on this kernel; see test_socketcan.py", allow_module_level=True)


def test_the_python_receiver_flies_on_vcan(tmp_path):
    truth = tmp_path / "truth.csv"
    words = ["--vehicle", str(VEHICLE), "--bus", SPEC, "--once", "--quiet"]
    link = open_link(SPEC)
    flight = subprocess.Popen([*FLIGHT, *words])
    receiver = start({"GNSS_HIL_BUS": SPEC, "GNSS_HIL_DURATION": str(EPOCHS)}, truth)
    heard = []
    while receiver.poll() is None:
        heard.append(link.receive(0.1))
    assert receiver.returncode == 0, receiver.stderr.read()
    assert exit_status(flight) == 0
    assert link.dropped == 0
    link.close()
    worst_m = max(math.dist(*pair) for pair in zip(fixes(concat(heard)), positions(truth), strict=True))
    assert worst_m < AGREEMENT_M
    print(f"vcan: {EPOCHS} fixes, {1e3 * worst_m:.2f} mm at most")


def fixes(frames: FrameBatch) -> list[list[float]]:
    """Position of each epoch in lockstep: every mark is followed by one of each axis."""
    spoken = codec(1)
    ids = [spoken.can_id_of[kind, 0] for kind in KINDS]
    order = [can_id for can_id in frames.can_id.tolist() if can_id in ids]
    assert order == ids * EPOCHS
    axes = [
        spoken.decode(kind, frames[frames.can_id == can_id].data)[f"{kind[-1].lower()}_m"]
        for kind, can_id in zip(KINDS[1:], ids[1:], strict=True)
    ]
    return [list(row) for row in zip(*axes, strict=True)]


def positions(truth: Path) -> list[list[float]]:
    with truth.open() as file:
        return [[float(row[f"{axis}_ecef_m"]) for axis in "xyz"] for row in csv.DictReader(file)]
