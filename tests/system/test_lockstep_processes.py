"""Emulator and flight software as two processes on the embedded bus: same frames, whatever happens."""

from __future__ import annotations

import hashlib
import json
import re
import signal
import subprocess
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import from_wire
from gnss_hil.dbc.lockstep import messages
from tests.support.programs import EMULATOR, FLIGHT
from tests.support.waiting import HANG_S, exit_status, pause, until

pytestmark = pytest.mark.verifies(
    "emulator/__main__.py",
    "flightsw/__main__.py",
    "dbc/process/command_line.py",
    "dbc/process/bus_link.py",
    "dbc/process/shutdown.py",
    "dbc/bus/probe.py",
    what="The emulator and the flight software as processes",
    by="rules of ours: paces, stops, who is on a bus already",
    status="modelled",
)

CODEC = codec(4)
VEHICLE = vehicle.find("soyuz-ms")
EPOCHS = 150
TIME_MARK = CODEC.can_id_of["TIME_MARK", 0]
PROGRAMS = {"emulator": EMULATOR, "flightsw": FLIGHT}


class Bench:
    """A hub whose tap keeps each peer's frames, and the two processes on it."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.wire: dict[int, bytearray] = {}
        self._epochs, self._orders = 0, {}
        self.hub = Hub(folder / "bus.sock", [self._keep])
        self.processes: list[subprocess.Popen] = []

    def _keep(self, peer: int, wire: bytes) -> None:
        self.wire.setdefault(peer, bytearray()).extend(wire)
        for _ in range(int((from_wire(wire).can_id == TIME_MARK).sum())):
            self._epochs += 1
            self._orders.pop(self._epochs, lambda: None)()

    def at_epoch(self, number: int, act: Callable[[], None]) -> None:
        """Act when the time mark of the epoch of this number, from 1, is on the bus: in the bus's own thread,
        so that the run goes no further before."""
        self._orders[number] = act

    def asked(self) -> int:
        """How many epochs were closed with SYNC, repetitions too."""
        return sum(int((from_wire(bytes(w)).can_id == messages.SYNC_ID).sum()) for w in self.wire.values())

    def start(self, module: str, *arguments: str) -> subprocess.Popen:
        command = [*PROGRAMS[module], "--bus", f"embedded:{self.hub.path}", *arguments]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        self.processes.append(process)
        return process

    def fly(self, *arguments: str) -> subprocess.Popen:
        return self.start("flightsw", "--vehicle", str(VEHICLE), "--quiet", *arguments)

    def emulate(self, *arguments: str, duration_s: int = EPOCHS) -> subprocess.Popen:
        return self.start(
            "emulator", "soyuz", "--duration", str(duration_s), "--quiet", "--session", "7",
            "--truth", str(self.folder / "truth"), "--status", str(self.folder / "status"), *arguments,
        )  # fmt: skip

    def status(self) -> list[dict]:
        path = self.folder / "status"
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def reached(self, epoch: int) -> None:
        """Waits until the emulator told of `epoch`."""
        until(lambda: any(line.get("epoch", -1) >= epoch for line in self.status()))

    def joined(self, peers: int) -> None:
        """Waits until so many are on the bus."""
        until(lambda: self.hub.peers >= peers)

    def close(self) -> None:
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.wait()
            process.stderr.close()
        self.hub.close()


@pytest.fixture
def processes():
    with RuntimeDir() as folder:
        made = Bench(folder)
        yield made
        made.close()


def played(wire: dict[int, bytearray]) -> tuple[str, int]:
    """SHA-256 of a run's frames, both directions in canonical order, and how many answers were repeated."""
    emulator, flight = sorted(
        (from_wire(bytes(w)) for w in wire.values()), key=lambda f: f.can_id[0] == 0x10, reverse=True
    )
    answers, start = {}, 0
    repeated = 0
    for row in messages.rows(flight):
        done = messages.judge(flight, row, 7, start)
        answer = flight[row - done.count : row].data.tobytes()
        assert answers.setdefault(done.epoch, answer) == answer, "a repeated answer differs"
        repeated += start == done.epoch + 1
        start = done.epoch + 1
    assert sorted(answers) == list(range(EPOCHS))
    spacecraft = emulator[~messages.is_bench(emulator.can_id)]
    digest = hashlib.sha256(spacecraft.can_id.tobytes() + spacecraft.data.tobytes())
    for epoch in range(EPOCHS):
        digest.update(answers[epoch])
    return digest.hexdigest(), repeated


def run(processes: Bench, disturb=lambda emulator, flight: None, late: bool = False):
    """Digest of a run's frames, how many answers were repeated. `disturb` acts on the processes as the run
    begins; with `late` the flight software starts when the emulator waits for it already."""
    emulator = processes.emulate()
    if late:
        processes.joined(1)  # the emulator waits at the barrier
    flight = processes.fly("--once")
    disturb(emulator, flight)
    assert exit_status(emulator) == 0, emulator.communicate()
    assert exit_status(flight) == 0, flight.communicate()
    assert processes.hub.failure is None
    ended = processes.status()[-1]
    assert (ended["event"], ended["reason"], ended["epochs_unanswered"]) == ("ended", "COMPLETED", 0)
    assert ended["frames"]["lost"] == 0
    return played(processes.wire)


@pytest.fixture(scope="module")
def undisturbed():
    with RuntimeDir() as folder:
        bench_ = Bench(folder)
        try:
            yield run(bench_)[0]
        finally:
            bench_.close()


def test_a_late_start_changes_no_frame(processes, undisturbed):
    assert run(processes, late=True)[0] == undisturbed


@pytest.mark.parametrize("which", ["emulator", "flight"])
def test_a_paused_process_changes_no_frame(processes, undisturbed, which):
    stopped = threading.Event()

    def disturb(emulator, flight):
        victim = emulator if which == "emulator" else flight

        def stop():
            victim.send_signal(signal.SIGSTOP)
            stopped.set()

        processes.at_epoch(10, stop)
        assert stopped.wait(HANG_S)
        if victim is flight:  # until the emulator has asked again
            asked = processes.asked()
            until(lambda: processes.asked() > asked + 1, emulator)
        else:
            pause(1.0)
        victim.send_signal(signal.SIGCONT)

    digest, repeated = run(processes, disturb)
    assert digest == undisturbed
    assert repeated > 0 or which == "emulator"


def test_truth_is_written_row_by_row(processes, undisturbed):
    run(processes)
    header, _, rows = (processes.folder / "truth").read_bytes().partition(b"\n")
    header = json.loads(header)
    assert header["craft"] == ["soyuz"]
    kind = np.dtype([tuple(tuple(p) if isinstance(p, list) else p for p in f) for f in header["dtype"]])
    truth = np.frombuffer(rows, kind)
    assert len(truth) == EPOCHS
    assert np.all(np.diff(truth["t_gps_ns"]) == 1_000_000_000)
    assert np.allclose(np.linalg.norm(truth["position_ecef_m"], axis=1), 6_793e3, atol=30e3)


def test_interrupting_the_emulator_ends_the_run_for_both(processes):
    flight = processes.fly("--once")
    emulator = processes.emulate("--pace", "x10", duration_s=3600)
    processes.reached(1)
    emulator.send_signal(signal.SIGINT)
    assert exit_status(emulator) == 130
    assert exit_status(flight) == 0
    assert processes.status()[-1]["reason"] == "INTERRUPTED"


def test_a_dead_flight_software_is_counted_and_time_goes_on(processes):
    flight = processes.fly()
    emulator = processes.emulate("--limit", "0.02", "--unanswered", "0", duration_s=200)
    processes.at_epoch(10, flight.kill)
    assert exit_status(emulator) == 0
    ended = processes.status()[-1]
    assert ended["epoch"] == 200
    assert ended["epochs_unanswered"] >= 190  # before its death too, where the machine is busy


@pytest.mark.parametrize("pace", ["lockstep", "x20"])
def test_a_restarted_flight_software_has_a_fix_in_the_first_epoch_it_hears_whole(processes, pace):
    """Its receivers never stopped: this is their warm start, not theirs and its own."""
    flight = processes.fly()
    processes.at_epoch(150, flight.kill)
    emulator = processes.emulate("--pace", pace, "--limit", str(HANG_S), duration_s=3600)
    exit_status(flight)
    again = processes.fly()
    processes.joined(2)

    def opened():
        """What it has said that the bus has passed on by now."""
        (_, answers) = max((peer, from_wire(bytes(wire))) for peer, wire in processes.wire.items())
        return answers.data[answers.can_id == CODEC.can_id_of["NAV_STATUS", 0]]

    until(lambda: len(opened()) > 20, again, emulator)
    emulator.send_signal(signal.SIGINT)
    assert exit_status(emulator) == 130
    if pace == "lockstep":
        assert processes.status()[-1]["epochs_unanswered"] == 1
    said = CODEC.decode("NAV_STATUS", opened())
    assert (said["mode"] == 2).all() and said["satellites"].min() > 15


def test_a_restarted_emulator_is_another_run_and_is_picked_up(processes):
    processes.fly()
    processes.joined(1)
    sessions = []
    for _ in range(2):
        emulator = processes.start(
            "emulator", "soyuz", "--quiet", "--status", str(processes.folder / "status")
        )
        processes.reached(10)
        emulator.kill()
        emulator.wait()
        marks = from_wire(bytes(processes.wire[max(processes.wire)]))
        mark = marks.data[marks.can_id == CODEC.can_id_of["TIME_MARK", 0]][:1]
        sessions.append(int(CODEC.decode("TIME_MARK", mark)["session"][0]))
        (processes.folder / "status").unlink()
    assert sessions[0] != sessions[1]


def test_a_flight_software_returns_to_a_bus_that_returns(processes):
    flight = processes.fly()
    processes.joined(1)
    processes.hub.close()
    processes.hub = Hub(processes.folder / "bus.sock", [processes._keep])
    processes.joined(1)
    assert exit_status(processes.emulate(duration_s=20)) == 0
    assert processes.status()[-1]["epochs_unanswered"] == 0
    assert flight.poll() is None


def test_the_flight_software_leaves_when_told(processes):
    flight = processes.fly()
    processes.joined(1)
    flight.send_signal(signal.SIGTERM)
    assert exit_status(flight) == 143
    assert flight.communicate()[1] == ""


def test_a_free_running_pace_takes_its_time(processes):
    flight = processes.fly("--once")
    emulator = processes.emulate("--pace", "x20")
    assert exit_status(emulator) == 0 and exit_status(flight) == 0
    ended = processes.status()[-1]
    assert ended["real_time_factor"] < 21
    assert ended["epoch_latency_ms"]["p50"] > 0


def test_an_ended_bus_ends_the_flight_software(processes):
    flight = processes.fly("--once")
    processes.joined(1)
    processes.hub.close()
    assert exit_status(flight) == 1
    assert flight.communicate()[1] == "flightsw: the hub closed the bus\n"


MISTAKES = [
    (["emulator", "soyuz", "--bus", "socketcan:vcan77"], 3, r"no CAN|no such CAN interface 'vcan77'"),
    (["emulator", "soyuz", "--bus", "embedded:/nowhere/bus"], 3, "embedded:/nowhere/bus.*No such file"),
    (["emulator", "soyuz", "--bus", "nonsense"], 2, "not of the form INTERFACE:CHANNEL"),
    (["emulator", "soyuz", "--bus", "warp:9"], 2, "warp"),
    (["emulator", "soyuz", "--bus", "virtual:x", "--pace", "warp"], 2, "--pace 'warp': not one of lockstep"),
    (["emulator", "nowhere", "--bus", "virtual:x"], 2, "scenario 'nowhere': not found"),
    (
        ["emulator", "soyuz", "--bus", "iss=virtual:x", "--bus", "virtual:y"],
        2,
        "one CRAFT=BUS for each craft",
    ),
    (["emulator", "soyuz", "--bus", "virtual:x", "--duration", "-1"], 2, "must be finite and greater than 0"),
    (["emulator", "soyuz", "--bus", "virtual:x", "--truth", "/nowhere/t"], 2, "/nowhere/t: No such file"),
    (["emulator", "soyuz", "--bus", "virtual:x", "--status", "fd:99"], 2, "fd:99: Bad file descriptor"),
    (["emulator", "soyuz", "--bus", "virtual:x", "--require", "WARP"], 2, "no node 'WARP'"),
    (
        ["emulator", "soyuz", "--bus", "virtual:x", "--session", "70000"],
        2,
        "'70000': a whole number from 1 to 65535",
    ),
    (["emulator", "soyuz", "--bus", "virtual:x", "--wait", "0.1"], 1, "no heartbeat from FLIGHT"),
    (["emulator", "soyuz"], 2, "--bus"),
    (["flightsw", "--bus", "virtual:x", "--vehicle", "/nowhere.toml"], 2, "no such file; shipped are"),
    (["flightsw", "--bus", "virtual:x", "--vehicle", str(VEHICLE), "--policy", "warp"], 2, "warp"),
    (["flightsw", "--bus", "virtual:x", "--vehicle", str(VEHICLE), "--option", "a"], 2, "KEY=VALUE"),
    (["flightsw", "--bus", "virtual:x", "--vehicle", str(VEHICLE), "--option", "warp=9"], 2, "warp"),
    (["flightsw", "--bus", "socketcan:vcan77", "--vehicle", str(VEHICLE)], 3, r"no CAN|no such CAN"),
    (["flightsw", "--bus", "virtual:x"], 2, "--vehicle"),
]


@pytest.mark.parametrize(
    ("arguments", "status", "line"), MISTAKES, ids=lambda v: v if isinstance(v, str) else None
)
def test_a_mistake_is_one_clear_line(arguments, status, line, capsys):
    main = import_module(f"gnss_hil.{arguments[0]}.__main__").main
    try:
        got = main([*arguments[1:], "--quiet"])
    except SystemExit as exit_:
        got = exit_.code
    said = capsys.readouterr().err
    assert got == status, said
    assert re.search(line, said), said
    assert said.count("\n") == 1 and "Traceback" not in said


@pytest.mark.parametrize("module", ["emulator", "flightsw"])
def test_help_has_examples(module):
    done = subprocess.run([*PROGRAMS[module], "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    assert f"python -m gnss_hil.{module} " in done.stdout and "examples:" in done.stdout
