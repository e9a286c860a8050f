"""The emulator as a process: what it tells whoever supervises it."""

import json
import subprocess
import sys
import time

import numpy as np

from gnss_hil.dbc.bus.base import open_link
from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.runtime_dir import PrivateFolder
from tests.support import emulated


def test_the_last_status_line_tells_which_commands_were_rejected():
    """Twenty times real time; a peer sends a good command's frame with one bit wrong, and nothing else."""
    good = emulated.sealed(emulated.command(1, 2, emulated.RELEASE))
    bad = type(good)(good.t_ns, good.can_id, good.length, good.data ^ np.uint8(4))
    with PrivateFolder() as folder:
        hub, status = Hub(folder / "bus.sock", []), folder / "status"
        link = open_link(f"embedded:{hub.path}")
        command = [
            sys.executable, "-P", "-m", "gnss_hil.emulator",
            "soyuz", "--bus", f"embedded:{hub.path}", "--pace", "x20",
            "--require", "none", "--duration", "40", "--quiet", "--status", str(status),
        ]  # fmt: skip
        emulator = subprocess.Popen(command)
        try:
            end_s, sent = time.monotonic() + 30, 0
            while emulator.poll() is None and time.monotonic() < end_s:
                if sent < 3 and status.exists() and '"progress"' in status.read_text():
                    link.send(bad)
                    sent += 1
                link.receive(0.05)
            assert emulator.wait(1) == 0
        finally:
            emulator.kill()
            link.close()
            hub.close()
        ended = json.loads(status.read_text().splitlines()[-1])
    assert (ended["event"], ended["reason"]) == ("ended", "COMPLETED")
    assert ended["commands_rejected"] == {"CORRUPTED": 3}
