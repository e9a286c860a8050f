"""`gnss-hil monitor` as a process on real embedded buses: piped, slow, cut off, on a terminal, with a run."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
from contextlib import contextmanager
from pathlib import Path

import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.open_link import open_link
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir, parent_folder
from gnss_hil.dbc.contract.frames import batch
from gnss_hil.dbc.lockstep import messages
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.monitor import discovery
from gnss_hil.tools.monitor.lines import ROOM_FRAMES
from tests.support.live_runs import epochs
from tests.support.programs import FLIGHT, GNSS_HIL
from tests.support.terminals import Session, row
from tests.support.waiting import ended, pause, until


@contextmanager
def bus():
    """A bus of ours: hub, specification, and a sender on it."""
    with RuntimeDir() as folder, Hub(folder / "can0") as hub:
        spec = f"embedded:{folder / 'can0'}"
        link = open_link(spec)
        yield hub, spec, link
        link.close()


def monitor(spec: str, *more: str, **pipes) -> subprocess.Popen:
    pipes = {"stdout": subprocess.PIPE, **pipes}
    command = [*GNSS_HIL, "monitor", "--bus", spec, *more]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **pipes)


def joined(hub: Hub, process, peers: int = 2) -> None:
    until(lambda: hub.peers >= peers, process)


def test_every_frame_is_a_line_and_the_totals_come_at_ctrl_c():
    blocks = epochs()[0][:70]
    with bus() as (hub, spec, link):
        process = monitor(spec)
        joined(hub, process)
        for block in blocks:
            link.send(block)
        link.send(batch([0x7AB], b"\x01"))
        lines = [process.stdout.readline() for _ in range(sum(map(len, blocks)) + 1)]
        process.send_signal(signal.SIGINT)
        out, err = ended(process)
    assert process.returncode == 130 and not out
    assert all(re.match(r"\(\d+\.\d{6}\) [0-9A-F]{3} \w+ \w+=", line) for line in lines[:-1])
    assert lines[-1].endswith("7AB ? 01 [WRONG_LENGTH]\n")
    assert re.search(r"^010 +TIME_MARK +TIME +70 +0$", err, re.M)
    assert re.search(rf"^{len(lines)} frames in .* s; wrong length 1$", err, re.M)
    assert "Traceback" not in err


def test_only_what_is_asked_for_is_shown_raw_lines_are_candumps():
    block = epochs()[0][-1]
    with bus() as (hub, spec, link):
        process = monitor(spec, "--only", "NAV_X", "--raw", "--duration", "3")
        joined(hub, process)
        while process.poll() is None:
            link.send(block)
            pause(0.2)
        out, _ = ended(process)
    (i,) = (block.can_id == 0x041).nonzero()[0]
    assert process.returncode == 0
    assert re.fullmatch(rf"(\(\d+\.\d{{6}}\) can0 041#{block.data[i].tobytes().hex().upper()}\n)+", out)


def test_a_bus_that_goes_away_is_one_line_and_a_run_that_ends_is_none():
    for farewell, status, says in (
        ((), 1, r"gnss-hil: bus embedded:\S+: the hub closed the bus"),
        ((messages.encode(messages.END_ID, 1, 10, 0),), 0, "gnss-hil: the bench has ended its run"),
    ):
        with bus() as (hub, spec, link):
            process = monitor(spec)
            joined(hub, process)
            for frames in (epochs()[0][0], *farewell):
                link.send(frames)
            for _ in range(len(epochs()[0][0]) + len(farewell)):
                process.stdout.readline()
            hub.close()
            _, err = ended(process)
        assert process.returncode == status
        assert re.search(f"^{says}$", err, re.M), err


@pytest.mark.slow
def test_a_reader_that_sleeps_does_not_hold_the_bus(tmp_path):
    """Four times as many frames as find room, the lines are not read: the sender is not held back."""
    block = epochs()[0][-1]
    rounds = 4 * ROOM_FRAMES // len(block)
    total = rounds * len(block) + 1
    with bus() as (hub, spec, link):
        process = monitor(spec)
        joined(hub, process)
        for _ in range(rounds):
            link.send(block)
        link.send(batch([0x7AB], b"\x01"))
        first = process.stdout.readline()
        seen, left_out = 1, 0
        for text in process.stdout:
            if match := re.fullmatch(r"# (\d+) frames not shown: the reader of this is too slow\n", text):
                left_out += int(match[1])
            else:
                seen += 1
            if seen + left_out >= total:
                break
        process.send_signal(signal.SIGINT)
        _, err = ended(process)
    assert first.startswith("(") and left_out > 0
    assert seen + left_out == total
    assert re.search(rf"^{total} frames in ", err, re.M)
    assert re.search(r"^\d+ frames not shown", err, re.M)


def test_a_reader_that_leaves_ends_it_quietly():
    with bus() as (hub, spec, link):
        process = monitor(spec)
        joined(hub, process)
        link.send(epochs()[0][-1])
        process.stdout.readline()
        process.stdout.close()
        while process.poll() is None:
            link.send(epochs()[0][-1])
            pause(0.05)
        assert process.returncode == 0
        assert "Traceback" not in process.stderr.read()
        process.stderr.close()


@pytest.mark.slow
@pytest.mark.verifies(
    "tools/monitor/table.py",
    "tools/monitor/lines.py",
    "tools/monitor/listening.py",
    "tools/monitor/output.py",
    what="Monitor: table and lines",
    by="pyte sees the table drawn, resized, left clean; raw lines are candump's form",
    status="validated",
)
def test_on_a_terminal_there_is_a_table_that_is_resized_and_left_clean():
    blocks = epochs()[0]
    with bus() as (hub, spec, link):
        session = Session("monitor", "--bus", spec, columns=100, lines=20)
        joined(hub, session.process)
        for block in blocks:
            link.send(block)
        session.watch(lambda: "epoch=74" in row(session, "010"))
        assert session.screen.alternate and "more identifiers" in session.text
        mark = row(session, "010")
        assert re.match(r"010 TIME_MARK +\d+\.\d ok +\d+s session=\d+ epoch=74", mark), mark
        session.resize(150, 120)
        session.watch(lambda: "FLIGHT_HEARTBEAT" in session.text and "sender" in session.text)
        link.send(batch(blocks[-1].can_id[:1], blocks[-1].data[:1] ^ 255))
        session.watch(lambda: "corrupted" in row(session, "010"))
        os.kill(session.process.pid, signal.SIGINT)
        assert session.end() == 130
    assert not session.screen.alternate and session.screen.cursor_shown
    after = session.raw[session.raw.rindex(b"\x1b[?1049l") :]
    assert b"corrupted 1" in after and b"TIME_MARK" in after


def connections(bus: str) -> int:
    """How many have joined a bus, as the kernel lists its sockets: the listening one, and one for each."""
    return Path("/proc/net/unix").read_text(errors="replace").count(bus.removeprefix("embedded:")) - 1


@pytest.mark.slow
def test_the_bus_of_a_run_is_found_and_the_run_does_not_mind(tmp_path):
    """Found without a path before the run begins; nothing is lost; the monitor ends with the run."""
    folder = tmp_path / "run"
    command = [*GNSS_HIL, "run", "--flight", "external", "--duration", "60", "--out", str(folder)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    spec = run.stderr.readline().split(" on ")[1].split(",")[0]
    until(lambda: connections(spec) == 1, run)  # the emulator
    listener = monitor_of_the_only_bus("--only", "NAV_STATUS")
    until(lambda: connections(spec) == 2, run, listener)
    subprocess.run([*FLIGHT, "--bus", spec, "--vehicle", "soyuz-ms", "--once", "--quiet"], check=True)
    out, _ = ended(run)
    written, err = ended(listener)
    assert run.returncode == 0 and " 0 lost, " in out
    assert listener.returncode == 0, err
    assert len(written.splitlines()) == 60 and all(
        " NAV_STATUS mode=" in text for text in written.splitlines()
    )
    assert "no faults" in err and "the bench has ended its run" in err


def monitor_of_the_only_bus(*more: str) -> subprocess.Popen:
    command = [*GNSS_HIL, "monitor", *more]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (["--bus", "embedded:/nowhere"], 3, "gnss-hil: bus 'embedded:/nowhere': No such file or directory"),
        (["--bus", "inline"], 2, "gnss-hil: --bus inline: it is inside one process, nobody can listen"),
        (["--bus", "embedded:/x", "--only", "RX1_RNAGE"], 2, "gnss-hil: --only RX1_RNAGE: no message"),
        (
            ["--bus", "embedded:/x", "--vehicle", "soyuz-ms", "--receivers", "2"],
            2,
            "gnss-hil: --receivers 2: ",
        ),
        (["--receivers", "9"], 2, "gnss-hil: --receivers: '9': 1 to 8"),
        (["--vehicle", "nope"], 2, "gnss-hil: vehicle 'nope': no such file"),
    ],
)
def test_a_mistake_is_one_line(capsys, arguments, status, says):
    assert main(["monitor", *arguments]) == status
    err = capsys.readouterr().err
    assert err.startswith(says) and err.count("\n") == 1


def test_which_bus_is_asked_when_there_are_several(capsys):
    with RuntimeDir() as first, RuntimeDir() as second:
        with Hub(first / "can0"), Hub(second / "can0"):
            assert main(["monitor"]) == 2
            line = capsys.readouterr().err
            assert "several are running" in line and str(first) in line and str(second) in line
        (first / "can0").touch()  # no socket
        with socket.socket(socket.AF_UNIX) as dead:  # a bench that was killed leaves its socket
            dead.bind(str(second / "can0"))
        assert discovery.sockets(parent_folder()) == []


def test_without_a_bench_there_is_one_clear_line(capsys):
    assert main(["monitor"]) == 3
    assert capsys.readouterr().err.startswith("gnss-hil: --bus embedded: no bench is running")


def test_a_bench_of_another_user_is_told_and_not_joined(capsys, monkeypatch):
    me = os.getuid()
    with bus() as (_, spec, _):
        monkeypatch.setattr(os, "getuid", lambda: me + 1)
        assert main(["monitor"]) == 3
        said = capsys.readouterr().err
        assert re.fullmatch(
            r"gnss-hil: --bus embedded: the bench that runs here is another user's \(\S+/can0\); .*\n", said
        )
        assert main(["monitor", "--bus", spec]) == 3
        said = capsys.readouterr().err
        assert said == f"gnss-hil: bus '{spec}': user {me} serves it, not you (user {me + 1})\n"


def test_the_monitor_ends_with_a_bench_that_is_killed(tmp_path):
    run = subprocess.Popen(
        [*GNSS_HIL, "run", "--pace", "realtime", "--out", str(tmp_path / "run"), "--quiet"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    until(lambda: discovery.sockets(parent_folder()), run)
    listener = monitor_of_the_only_bus()
    assert listener.stdout.readline()
    run.kill()
    run.wait()
    _, err = ended(listener)
    assert listener.returncode == 1
    assert re.search(r"^gnss-hil: bus embedded:\S+: the hub closed the bus$", err, re.M)
