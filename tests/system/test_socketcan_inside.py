"""On a kernel with CAN: can-utils as peers, losses told, two processes on vcan0.

`tests/system/test_socketcan.py` runs this in user-mode Linux where the machine's own kernel has no CAN.
"""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import can
import polars as pl
import pytest

from gnss_hil.dbc.bus.base import LinkError
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.allocation import BENCH_FIRST
from gnss_hil.dbc.contract.frames import EFF_FLAG, RTR_FLAG, batch, concat
from gnss_hil.tools.command_line.main import main
from tests.conformance.test_links import assert_same, gather, numbered, numbers
from tests.support.fsw_c import AGREEMENT_M, COPIES_M, build, distances_m, without_figures
from tests.support.lockstep_frames import mark
from tests.support.outside import can_utils
from tests.support.waiting import ended, exit_status, pause, until

VEHICLE = vehicle.find("soyuz-ms")
LAST = 0x1FFFFFFF | EFF_FLAG
"""Sent when nothing else is to come: frames arrive in their order, so those before it are all there."""
LAST_SAID = "1FFFFFFF#"

pytestmark = pytest.mark.socketcan

if "vcan0" not in {name for _, name in socket.if_nameindex()}:
    pytest.skip("no vcan0 on this kernel; see test_socketcan.py", allow_module_level=True)
can_utils("candump", "cansend")


@pytest.fixture
def link():
    link = open_link("socketcan:vcan0")
    yield link
    link.close()


def listeners() -> int:
    """Sockets that hear everything on vcan0."""
    lines = Path("/proc/net/can/rcvlist_all").read_text().splitlines()
    return sum(line.split()[:1] == ["vcan0"] for line in lines)


class Candump:
    """can-utils' listener, writing its log format."""

    def __init__(self, path: Path):
        self._path = path
        self._stream = path.open("w")
        before = listeners()
        command = ["candump", "-L", "-r", str(1 << 24), "vcan0"]
        self._process = subprocess.Popen(command, stdout=self._stream)
        until(lambda: listeners() > before, self._process)

    def frames(self) -> list[str]:
        """All frames that were on the bus before this call, as ID#DATA."""
        with closing(open_link("socketcan:vcan0")) as bus:
            bus.send(batch([LAST], b""))
        until(lambda: f" {LAST_SAID}\n" in self._path.read_text(), self._process)
        self.close()
        *frames, last = (line.split()[2] for line in self._path.read_text().splitlines())
        assert last == LAST_SAID
        return frames

    def close(self) -> None:
        self._process.terminate()
        self._process.wait()
        self._stream.close()


@pytest.fixture
def candump(tmp_path):
    listener = Candump(tmp_path / "candump.log")
    yield listener
    listener.close()


def test_candump_hears_a_raw_link_and_pythoncan(link, candump):
    link.send(concat((batch([0x123], b"\x01\xff"), batch([0x1ABCDEF0 | EFF_FLAG], b"12345678"))))
    link.send(batch([0x55 | RTR_FLAG], b"", length=4))
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        bus.send(can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b"\xaa"))
    assert candump.frames() == ["123#01FF", "1ABCDEF0#3132333435363738", "055#R4", "7FF#AA"]


def test_a_link_hears_cansend_and_pythoncan(link):
    subprocess.run(["cansend", "vcan0", "321#DEADBEEF"], check=True)
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        bus.send(can.Message(arbitration_id=0x12345, is_extended_id=True, data=b"abc"))
    expected = concat((batch([0x321], b"\xde\xad\xbe\xef"), batch([0x12345 | EFF_FLAG], b"abc")))
    assert_same(gather(link, 2), expected)


def test_the_kernel_grants_room_for_many_epochs(link):
    assert link.receive_buffer_bytes >= 16 << 20


def test_every_lost_frame_is_told(link):
    """A receiver with the smallest buffer, and a block that does not fit."""
    sleeper = open_link("socketcan:vcan0")
    sleeper._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
    link.send(numbered(500))
    heard = gather(sleeper, 500, 0.3)
    assert 0 < len(heard) < 500
    assert len(heard) + sleeper.dropped == 500
    sleeper.close()
    assert len(heard) + sleeper.dropped == 500


def test_a_paced_link_takes_the_time_of_a_real_bus(link):
    paced = open_link("socketcan:vcan0,paced")
    begun_s = time.monotonic()
    paced.send(numbered(1000))
    assert time.monotonic() - begun_s > 0.12  # 1000 frames of 128 bits with stuffing
    assert numbers(gather(link, 1000)) == list(range(1000))
    paced.close()


@pytest.mark.parametrize(
    ("spec", "reason"), [("socketcan:vcan9", "no such CAN interface 'vcan9'"), ("socketcan:lo", "'lo'")]
)
def test_no_such_interface_is_one_clear_line(spec, reason):
    with pytest.raises(LinkError, match=reason) as caught:
        open_link(spec)
    assert "\n" not in str(caught.value)


def test_an_interface_that_is_down_says_how_to_raise_it():
    subprocess.run(["ip", "link", "set", "vcan1", "down"], check=True)
    try:
        with pytest.raises(LinkError, match=r"'vcan1' is down \(ip link set vcan1 up\)"):
            open_link("socketcan:vcan1")
    finally:
        subprocess.run(["ip", "link", "set", "vcan1", "up"], check=True)


def run(module: str, *command: str, **more) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", f"gnss_hil.{module}", *command],
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


def test_an_emulator_refuses_a_bus_where_another_one_plays(link):
    emulator = run("emulator", "soyuz", "--bus", "socketcan:vcan0")
    while emulator.poll() is None:
        link.send(mark(5))
        pause(0.1)
    assert emulator.returncode == 3
    assert emulator.stderr.read() == (
        "emulator: bus 'socketcan:vcan0': TIME of another bench can be heard there\n"
    )


def test_a_run_refuses_a_bus_where_another_bench_plays(link, tmp_path):
    folder = tmp_path / "run"
    bench = run("tools.command_line.main", "run", "--bus", "socketcan:vcan0", "--out", str(folder))
    while bench.poll() is None:
        link.send(mark(5))
        pause(1.0)  # the rhythm of a bench at real time
    assert bench.returncode == 3
    assert bench.stderr.read() == (
        "gnss-hil: bus 'socketcan:vcan0': TIME of another bench can be heard there\n"
    )
    assert not folder.exists()


def test_two_processes_fly_on_vcan_without_a_loss(candump, tmp_path):
    flight = run("flightsw", "--vehicle", str(VEHICLE), "--bus", "socketcan:vcan0", "--once", "--quiet")
    status = tmp_path / "status"
    emulator = run(
        "emulator",
        "soyuz",
        "--bus",
        "socketcan:vcan0",
        "--duration",
        "60",
        "--status",
        str(status),
        "--quiet",
    )
    assert exit_status(emulator) == 0, emulator.stderr.read()
    assert exit_status(flight) == 0, flight.stderr.read()
    ended = json.loads(status.read_text().splitlines()[-1])
    assert (ended["epoch"], ended["epochs_unanswered"], ended["frames"]["lost"]) == (60, 0, 0)
    assert ended["real_time_factor"] > 0
    print(f"vcan: {ended['real_time_factor']:.1f} times real time, latency {ended['epoch_latency_ms']}")
    frames = candump.frames()
    spacecraft = [f for f in frames if int(f[:3], 16) < BENCH_FIRST]
    marks = sum(f.startswith("010#") for f in frames)
    waiting = len(spacecraft) - ended["frames"]["sent"] - ended["frames"]["received"]
    heartbeats = sum(f.startswith("710#") for f in frames)
    assert marks == 60
    assert waiting == heartbeats - 60  # candump heard every frame; more than that were only start heartbeats


@pytest.fixture(scope="module")
def fsw(tmp_path_factory) -> Path:
    """The flight software in C of examples/fsw_c."""
    folder = tmp_path_factory.mktemp("fsw_c")
    build(folder)
    return folder / "fsw"


def test_a_flight_software_in_c_flies_on_vcan_as_ours_does_inline(fsw, tmp_path):
    soyuz = without_figures(tmp_path)

    def flown(name: str, *more: str) -> pl.DataFrame:
        command = ["run", str(soyuz), "--duration", "120", "--quiet", "--out", str(tmp_path / name), *more]
        assert main(command) == 0
        return pl.read_parquet(tmp_path / name / "fixes.parquet")

    own = flown("ours", "--bus", "inline")
    other = flown("c", "--bus", "socketcan:vcan0", "--flight", str(fsw))
    summary = json.loads((tmp_path / "c" / "summary.json").read_text())
    assert (summary["frames"]["lost"], summary["frames"]["rejected"], summary["reproducible"]) == (
        0,
        {},
        True,
    )
    both = own.join(other, on="t_gps_s", suffix="_other")
    assert (both["valid"] == both["valid_other"]).all() and both["valid"].sum() > 80
    alike = both.filter(pl.col("satellites") == pl.col("measurements"))
    assert len(alike) > 80 and distances_m(alike).max() < AGREEMENT_M
    assert distances_m(both).max() < COPIES_M


def test_a_flight_software_in_c_outlives_an_emulator_on_vcan(fsw, link, tmp_path):
    """Killed in the middle of a run, and started again: the second run is whole."""
    flight = subprocess.Popen([fsw, "--bus", "socketcan:vcan0", "--vehicle", VEHICLE])
    emulate = ["emulator", "soyuz", "--bus", "socketcan:vcan0", "--quiet", "--status"]
    first = run(*emulate, str(tmp_path / "first"), "--duration", "600")
    while not len(link.receive(0.1)) or epochs_played(tmp_path / "first") < 20:
        assert first.poll() is None, first.stderr.read()
    first.kill()
    first.wait()
    second = run(*emulate, str(tmp_path / "second"), "--duration", "60")
    assert exit_status(second) == 0, second.stderr.read()
    assert exit_status(flight) == 0
    ended = json.loads((tmp_path / "second").read_text().splitlines()[-1])
    assert (ended["epoch"], ended["epochs_unanswered"], ended["frames"]["lost"]) == (60, 0, 0)


def epochs_played(status: Path) -> int:
    """How far an emulator has come."""
    lines = status.read_text().splitlines() if status.exists() else []
    return json.loads(lines[-1]).get("epoch", 0) if lines and lines[-1].endswith("}") else 0


def test_a_monitor_reads_vcan_whatever_is_on_it(link):
    before = listeners()
    monitor = run("tools.command_line.main", "monitor", "--bus", "socketcan:vcan0", stdout=subprocess.PIPE)
    until(lambda: listeners() > before, monitor)
    link.send(mark(5))
    for frame in ("123#R4", "12345678#0102", "7AB#DEADBEEF00000000", "010#00"):
        subprocess.run(["cansend", "vcan0", frame], check=True)
    said = [monitor.stdout.readline().split(maxsplit=1)[1] for _ in range(5)]
    monitor.send_signal(signal.SIGINT)
    _, err = ended(monitor)
    assert monitor.returncode == 130
    assert said == [
        "010 TIME_MARK session=7 epoch=5\n",
        "123 ? remote, length 4 [REMOTE]\n",
        "12345678 ? 01 02 [EXTENDED]\n",
        "7AB ? DE AD BE EF 00 00 00 00 [UNKNOWN_ID]\n",
        "010 TIME_MARK 00 [WRONG_LENGTH]\n",
    ]
    assert "unknown id 1, wrong length 1, remote 1, extended 1" in err
