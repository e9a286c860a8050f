"""The emulator as a process: what it reports to its supervisor."""

import json
import signal
import subprocess

import numpy as np
import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from tests.support import emulated
from tests.support.programs import EMULATOR
from tests.support.waiting import until

pytestmark = pytest.mark.verifies(what="Truth and status, as streams")


def another_epoch(status, link, emulator) -> None:
    """Waits until the emulator has reported one more epoch, and hears what it sends meanwhile."""

    def reported() -> int:
        link.receive(0.0)
        return status.read_text().count('"progress"') if status.exists() else 0

    before = reported()
    until(lambda: reported() > before, emulator)


def test_the_last_status_line_tells_which_commands_were_rejected():
    """A peer sends a good command's frame with one bit wrong, and nothing else."""
    good = emulated.sealed(emulated.command(1, 2, emulated.RELEASE))
    bad = type(good)(good.t_ns, good.can_id, good.length, good.data ^ np.uint8(4))
    with RuntimeDir() as folder:
        hub, status = Hub(folder / "bus.sock", []), folder / "status"
        link = open_link(f"embedded:{hub.path}")
        command = [
            *EMULATOR,
            "soyuz", "--bus", f"embedded:{hub.path}", "--pace", "x20",
            "--require", "none", "--duration", "3600", "--quiet", "--status", str(status),
        ]  # fmt: skip
        emulator = subprocess.Popen(command)
        try:
            for _ in range(3):
                another_epoch(status, link, emulator)
                link.send(bad)
            for _ in range(3):
                another_epoch(status, link, emulator)
            emulator.send_signal(signal.SIGINT)
            while emulator.poll() is None:
                link.receive(0.05)
        finally:
            emulator.kill()
            link.close()
            hub.close()
        ended = json.loads(status.read_text().splitlines()[-1])
    assert (ended["event"], ended["reason"]) == ("ended", "INTERRUPTED")
    assert ended["commands_rejected"] == {"CORRUPTED": 3}
