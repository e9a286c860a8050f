"""On a kernel with CAN: canplayer plays a run's log to our flight software, and so do we; candump records it.

`tests/system/test_socketcan.py` runs this in user-mode Linux where the machine's own kernel has no CAN.
"""

from __future__ import annotations

import signal
import socket
import subprocess
from pathlib import Path

import pytest

from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.contract.messages import FLIGHT_NODE
from gnss_hil.dbc.lockstep.messages import END_ID
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.recording.formats.candump import format_lines
from gnss_hil.tools.recording.formats.recording import Recording
from gnss_hil.tools.replay.recorded_run import open_run
from tests.support.outside import can_utils
from tests.support.programs import FLIGHT
from tests.support.waiting import HANG_S, exit_status, until
from tests.system.test_socketcan_inside import Candump

pytestmark = [
    pytest.mark.socketcan,
    pytest.mark.verifies(
        "tools/replay/recorded_run.py",
        "tools/replay/players.py",
        "tools/replay/peer.py",
        "tools/replay/compare.py",
        "tools/replay/source.py",
        "tools/replay/session.py",
        what="Replay",
        by=(
            "canplayer plays, candump hears it on a real vcan; either side brings the recorded run about "
            "byte for byte"
        ),
        status="validated",
    ),
]

if "vcan0" not in {name for _, name in socket.if_nameindex()}:
    pytest.skip("no vcan0 on this kernel; see test_socketcan.py", allow_module_level=True)

BUS = "socketcan:vcan0"
NAV_X, HEARTBEAT = 0x041, 0x700 + FLIGHT_NODE
PLAYED = slice(-9, None)
"""Epochs that canplayer plays, a second each."""


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "run"
    words = ["run", "--bus", "inline", "--duration", "48", "--out", str(folder), "--quiet", "--no-report"]
    assert main(words) == 0
    return folder / "bus.log"


@pytest.fixture
def flight():
    """Our flight software on vcan0, ready."""
    words = [
        *FLIGHT,
        "--vehicle",
        "soyuz-ms",
        "--bus",
        BUS,
        "--quiet",
    ]
    link = open_link(BUS)
    process = subprocess.Popen(words)
    until(lambda: HEARTBEAT in link.receive(0.5).can_id, process)
    link.close()
    yield process
    process.send_signal(signal.SIGINT)
    assert exit_status(process) == 130


def test_canplayer_plays_a_run_and_the_flight_software_finds_its_fixes(log, flight, tmp_path):
    can_utils("canplayer")
    recorded = open_run(Recording(log), None, None)
    part = tmp_path / "part.log"
    with part.open("wb") as stream:
        for epoch in list(recorded.epochs())[PLAYED]:
            stream.write(format_lines(epoch.emulator.t_ns // 1000, epoch.emulator, "can0"))
    candump = Candump(tmp_path / "heard.log")
    subprocess.run(["canplayer", "-I", str(part), "vcan0=can0"], check=True, timeout=HANG_S)
    heard = tmp_path / "heard.log"
    until(lambda: heard.read_text().count(f" {NAV_X:03X}#") >= 5)  # canplayer sends none
    played = len(part.read_bytes().splitlines())
    assert len(candump.frames()) > played > 500


def test_we_play_it_in_lockstep_and_candump_has_the_same_run(log, flight, tmp_path):
    out, heard = tmp_path / "again.log", tmp_path / "heard.log"
    candump = Candump(heard)
    words = ["--only", "emulator", "--bus", BUS, "--same", "--out", str(out), "--quiet"]
    assert main(["replay", str(log), *words]) == 0
    until(lambda: f" {END_ID:03X}#" in heard.read_text())  # candump may be behind: lockstep is fast
    candump.close()
    assert out.read_bytes() == log.read_bytes()
    ours, theirs = (open_run(Recording(path), None, None) for path in (log, heard))
    for mine, other in zip(ours.epochs(), theirs.epochs(), strict=True):
        assert (mine.emulator.data == other.emulator.data).all()
        assert (mine.flight.data == other.flight.data).all()
