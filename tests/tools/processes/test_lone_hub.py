"""`gnss-hil hub` as a process: who joins, what it leaves, what it refuses."""

from __future__ import annotations

import re
import signal
import socket
import stat
import subprocess
from contextlib import closing

import pytest

from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.tools.command_line.main import main
from tests.support.live_runs import epochs
from tests.support.programs import GNSS_HIL
from tests.support.waiting import HANG_S, ended, until

pytestmark = pytest.mark.verifies(
    "tools/processes/lone_hub.py",
    what="An embedded bus without a run",
    by="two peers, an emulator, a foreign socket at its path, signals",
    status="validated",
)


@pytest.fixture
def hub(tmp_path):
    """`gnss-hil hub` that serves."""
    process = subprocess.Popen(
        [*GNSS_HIL, "hub", str(tmp_path / "bus")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    said = process.stdout.readline()
    assert said == f"gnss-hil: serving embedded:{tmp_path / 'bus'}; Ctrl-C ends it\n"
    yield process
    if process.poll() is None:
        process.kill()
        process.wait()
    process.stdout.close()
    process.stderr.close()


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_peers_hear_each_other_until_a_signal_ends_it(hub, tmp_path, number, status):
    path = tmp_path / "bus"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    block = epochs()[0][0]
    first, second = (open_link(f"embedded:{path}") for _ in range(2))
    first.send(block)
    heard = second.receive(HANG_S)
    while len(heard) < len(block):
        heard = [*heard.can_id, *second.receive(HANG_S).can_id]
    hub.send_signal(number)
    out, err = ended(hub)
    assert (hub.returncode, out, err) == (status, f"gnss-hil: {len(block)} frames of 2 peers\n", "")
    assert not path.exists()
    first.close()
    second.close()


def test_one_frame_is_no_frames(hub, tmp_path):
    first, second = (open_link(f"embedded:{tmp_path / 'bus'}") for _ in range(2))
    with closing(first), closing(second):
        first.send(epochs()[0][0][:1])
        assert len(second.receive(HANG_S)) == 1
        hub.send_signal(signal.SIGINT)
        assert ended(hub) == ("gnss-hil: 1 frame of 2 peers\n", "")


def test_the_socket_of_another_is_left_alone(hub, tmp_path):
    path = tmp_path / "bus"
    path.unlink()
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(path))
        assert "the socket is no longer ours" in hub.stderr.readline()
        hub.send_signal(signal.SIGINT)
        _, err = ended(hub)
        assert (hub.returncode, err) == (130, "")
        assert path.is_socket()


def test_where_it_cannot_serve_it_says_so(hub, tmp_path, capsys):
    (tmp_path / "file").touch()
    for path, why in (
        (tmp_path / "bus", "another process serves it"),
        (tmp_path / "file", "something else than a socket is there"),
        (tmp_path / "nowhere" / "bus", "No such file or directory"),
        (tmp_path / ("x" * 108), "the path is longer than 107 bytes"),
    ):
        assert main(["hub", str(path)]) == 3
        assert re.fullmatch(rf"gnss-hil: bus 'embedded:\S+': {why}\n", capsys.readouterr().err)


def test_a_run_is_played_on_it(hub, tmp_path):
    """Emulator and monitor, each a process of its own, meet there."""
    spec = f"embedded:{tmp_path / 'bus'}"
    listener = subprocess.Popen(
        [*GNSS_HIL, "monitor", "--bus", spec, "--only", "BENCH_*"], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    emulator = subprocess.Popen(
        [*GNSS_HIL, "emulate", "soyuz", "--duration", "5", "--bus", spec, "--quiet"], stderr=subprocess.PIPE
    )
    flight = subprocess.run(
        [*GNSS_HIL, "fly", "--vehicle", "soyuz-ms", "--bus", spec, "--once", "--quiet"], capture_output=True
    )
    _, said = ended(emulator)
    assert (emulator.returncode, flight.returncode) == (0, 0), (said, flight.stderr)
    until(lambda: listener.stdout.readline())
    hub.send_signal(signal.SIGINT)
    ended(hub)
    _, err = ended(listener)
    assert "ended its run" in err
