"""On a kernel with CAN: the emulator of examples/receiver_py against our flight software on vcan0.

`tests/system/test_socketcan.py` runs this in user-mode Linux where the machine's own kernel has no CAN.
"""

from __future__ import annotations

import socket

import pytest

from tests.system.receiver_py import played

EPOCHS = 60
AGREEMENT_M = 0.01

pytestmark = pytest.mark.socketcan

if "vcan0" not in {name for _, name in socket.if_nameindex()}:
    pytest.skip("no vcan0 on this kernel; see test_socketcan.py", allow_module_level=True)


def test_the_python_receiver_flies_on_vcan(tmp_path):
    judged = played(tmp_path, EPOCHS, "--bus", "socketcan:vcan0")
    assert len(judged) == EPOCHS and judged["valid"].all()
    assert judged["position_m"].max() < AGREEMENT_M
    print(f"vcan: {EPOCHS} fixes, {1e3 * judged['position_m'].max():.2f} mm at most")
