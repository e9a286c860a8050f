"""On a kernel with CAN: `cangw` with the rules of `inject --as-cangw` does what the faults do, byte by byte.

`tests/system/test_socketcan.py` runs this in user-mode Linux where the machine's own kernel has no CAN.
"""

from __future__ import annotations

import socket
import subprocess

import numpy as np
import pytest

from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.frames import EFF_FLAG, EMPTY, RTR_FLAG, FrameBatch, batch, concat
from gnss_hil.dbc.lockstep.messages import is_bench
from gnss_hil.emulator.faults import engine, files
from gnss_hil.emulator.faults.base import At, Direction
from gnss_hil.tools.command_line.main import main
from tests.support.faulted import CODEC, VEHICLE
from tests.support.outside import can_utils
from tests.support.waiting import HANG_S

pytestmark = pytest.mark.socketcan

if not {"vcan0", "vcan1"} <= {name for _, name in socket.if_nameindex()}:
    pytest.skip("no vcan0 and vcan1 on this kernel; see test_socketcan.py", allow_module_level=True)
can_utils("cangw")

LAST = batch([0x7FF], b"last")
"""Passes by every rule, behind all others."""


@pytest.fixture
def links():
    links = [open_link(f"socketcan:vcan{n}") for n in (0, 1)]
    yield links
    subprocess.run(["cangw", "-F"], check=True)
    for link in links:
        link.close()


def every_frame() -> FrameBatch:
    """Frames of all identifiers, two of each and intact, in any order; others than the contract's too."""
    draw = np.random.default_rng(1)
    can_id = draw.permutation(np.repeat(np.arange(0x7FF, dtype=np.uint32), 2))
    can_id = can_id[~is_bench(can_id)]
    data = draw.integers(0, 256, (len(can_id), 8), np.uint8)
    data[:, 1] = data[:, 1] & 0xF0 | draw.integers(0, e2e.COUNTERS, len(can_id), np.uint8)
    data[:, 0] = e2e.crc(can_id, data)
    odd = np.array([EFF_FLAG | 0x100, EFF_FLAG | 0x12345678, RTR_FLAG | 0x100, EFF_FLAG | RTR_FLAG | 0x110])
    strange = batch(odd, np.array([[1, 2, 3, 4, 5, 6, 7, 8]] * 2 + [[0] * 8] * 2, np.uint8))
    return concat((batch(can_id, data), strange))


@pytest.mark.parametrize(
    "faults",
    [
        ("rx1 RANGE,RATE loss",),
        ("0x100&0x7F0 loss", "ACK ack-lost"),
        ("rx1 RANGE wrong-address 0x110",),
        ("RANGE.pseudorange_m = 22000000",),
        ("SV_Z.health = UNHEALTHY", "ATT_Q01.q0 = 0.5"),
        ("RANGE.pseudorange_m = 22000000 protection=wrong",),
        ("ATT corruption flip=0000FF0000000001",),
        ("RX2_RANGE corruption flip=0000FF0000000001 protection=recompute",),
        ("rx3 crc wrong",),
        ("rx1 RANGE length 4",),
        ("rx2 asymmetric",),
        ("COMMAND command-lost",),
        ("RX1_RATE loss", "RX2_RATE crc wrong", "RX3_RANGE.pseudorange_m = 20200000"),
        (),
    ],
    ids=lambda faults: "; ".join(faults) or "none",
)
def test_the_kernel_does_to_every_frame_what_the_faults_do(links, capsys, faults):
    words = ["--as-cangw", "--from", "socketcan:vcan0", "--to", "socketcan:vcan1"]
    assert main(["inject", *faults, *words]) == 0
    done = subprocess.run(["sh"], input=capsys.readouterr().out, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    plan = engine.armed([files.of_line(one) for one in faults], "soyuz", VEHICLE, CODEC, 10**9, 0)
    frames = every_frame()
    for way, source, sink in (
        (Direction.FLIGHT, links[0], links[1]),
        (Direction.RECEIVERS, links[1], links[0]),
    ):
        _, struck, _ = engine.inject(plan, engine.fresh(plan), frames, At(0, 0, way))
        heard = carried(source, sink, frames)
        assert lines(heard) == lines(struck)


def carried(source, sink, frames: FrameBatch) -> FrameBatch:
    """What the kernel makes of frames on their way."""
    heard = EMPTY
    source.send(concat((frames, LAST)))
    while not (len(heard) and heard.can_id[-1] == LAST.can_id[0]):
        piece = sink.receive(HANG_S)
        assert len(piece), f"{len(heard)} frames came, and not the last"
        heard = concat((heard, piece))
    assert sink.dropped == 0
    return heard[:-1]


def lines(frames: FrameBatch) -> list[str]:
    """As candump writes them; of a remote frame the data is nobody's."""
    return [
        f"{can_id:X}#{'R' if can_id & RTR_FLAG else bytes(data[:length]).hex()}"
        for can_id, data, length in zip(frames.can_id.tolist(), frames.data, frames.length, strict=True)
    ]
