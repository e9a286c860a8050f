"""The emulator of examples/receiver_py, written from the contract: what our flight software makes of it.

It has its own truth, so agreement means that a third party understood the contract as we do.
"""

from __future__ import annotations

import ast
import json
import os
import random
import shlex
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from importlib import util
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.common.vehicle import find
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import EFF_FLAG, RTR_FLAG
from gnss_hil.dbc.contract.generate import dbc_text
from gnss_hil.dbc.contract.values import VALUES
from gnss_hil.tools.command_line.main import main
from tests.support.feeder import DONE, HEARTBEAT, pack
from tests.support.programs import FLIGHT
from tests.support.receiver_py import EXAMPLE, PROGRAM, VEHICLE, start
from tests.support.waiting import ended, until

pytestmark = pytest.mark.verifies(
    "examples/receiver_py/receiver.py",
    "examples/receiver_py/sky.py",
    "examples/receiver_py/orbit.py",
    what="A receiver as a third party would write it",
    by="our flight software, which shares no code with it, finds its truth: 0.3 mm",
    status="modelled",
)

EPOCHS = 310
AGREEMENT_M = 0.01
COMMAND = 0x020
AXES = ("x_ecef_m", "y_ecef_m", "z_ecef_m")
SPEEDS = ("vx_ecef_mps", "vy_ecef_mps", "vz_ecef_mps")


def played(folder: Path, epochs: int, *more: str) -> pl.DataFrame:
    """A run with the example as emulator, into folder/run: `errors` of the fixes."""
    truth, run = folder / "truth.csv", folder / "run"
    command = shlex.join([sys.executable, str(PROGRAM), str(truth)])
    words = ["--vehicle", str(VEHICLE), "--duration", str(epochs), "--out", str(run), "--quiet", *more]
    assert main(["run", "soyuz", "--emulator", command, *words]) == 0
    return errors(pl.read_parquet(run / "fixes.parquet"), truth)


def errors(fixes: pl.DataFrame, truth: Path) -> pl.DataFrame:
    """Distances of fixes from the truth file, nan where there was no fix: position_m, velocity_mps."""
    both = fixes.join(pl.read_csv(truth).cast(pl.Float64), on="t_gps_s", suffix="_true")

    def distance(names):
        return sum((pl.col(name) - pl.col(f"{name}_true")) ** 2 for name in names).sqrt()

    return both.select("t_gps_s", "valid", position_m=distance(AXES), velocity_mps=distance(SPEEDS))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A lockstep run on the embedded bus: its folder and the errors of its fixes."""
    folder = tmp_path_factory.mktemp("receiver_py")
    orbit = subprocess.run([sys.executable, EXAMPLE / "orbit.py"], capture_output=True, text=True, check=True)
    (folder / "orbit.oem").write_text(orbit.stdout)
    return folder / "run", played(folder, EPOCHS, "--reference", str(folder / "orbit.oem"))


def test_every_fix_is_where_the_receivers_craft_was(run):
    _, judged = run
    assert len(judged) == EPOCHS and judged["valid"].all()
    assert judged["position_m"].max() < AGREEMENT_M
    assert judged["velocity_mps"].max() < 0.001
    print(f"{EPOCHS} fixes, {1e3 * judged['position_m'].max():.2f} mm and "
          f"{1e3 * judged['velocity_mps'].max():.2f} mm/s at most")  # fmt: skip


def test_the_orbit_that_it_says_to_fly_judges_the_run(run):
    folder, judged = run
    (craft,) = json.loads((folder / "summary.json").read_text())["craft"].values()
    assert craft["position_error_m"]["max"] == pytest.approx(judged["position_m"].max(), abs=1e-5)
    assert craft["position_error_m"]["max"] < 0.001


def test_channels_are_commanded_and_nothing_is_lost_or_refused(run):
    folder, _ = run
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["frames"]["lost"] == 0 and summary["frames"]["rejected"] == {}
    assert summary["epochs"] == EPOCHS and summary["epochs_unanswered"] == 0
    (craft,) = summary["craft"].values()
    assert craft["assignment"]["commands"] >= craft["satellites_tracked"]["min"]
    assert craft["assignment"]["rejected"] == 0


def test_the_run_has_the_receivers_time(run):
    folder, _ = run
    t_gps_s = pl.read_parquet(folder / "fixes.parquet")["t_gps_s"]
    assert t_gps_s[0] == 2400 * 604_800
    assert set(np.diff(t_gps_s.to_numpy())) == {1.0}


def test_free_pace_amid_rubbish(tmp_path):
    """Without lockstep, while somebody sends rubbish with the identifiers that the receiver listens to."""
    over = threading.Event()
    with RuntimeDir() as private:
        rubbish = threading.Thread(target=litter, args=(private / "bus", over))
        rubbish.start()
        try:
            judged = played(tmp_path, 60, "--pace", "x10", "--bus", f"embedded:{private / 'bus'}")
        finally:
            over.set()
            rubbish.join()
    assert judged["valid"].sum() > 40  # of 60; in real time a busy machine answers some too late
    assert judged["position_m"].max() < AGREEMENT_M
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert sum(summary["frames"]["rejected"].values()) > 100


def litter(path: Path, over: threading.Event) -> None:
    """Sends rubbish every 2 ms from when the bus is there until it is gone."""
    dice = random.Random(6)
    with socket.socket(socket.AF_UNIX) as peer, suppress(BrokenPipeError):
        while peer.connect_ex(os.fspath(path)) and not over.wait(0.02):
            pass
        peer.shutdown(socket.SHUT_RD)
        while not over.wait(0.002):
            can_id = dice.choice((COMMAND, HEARTBEAT, DONE, 0x7FF, COMMAND | RTR_FLAG, COMMAND | EFF_FLAG))
            peer.sendall(pack(can_id, dice.randbytes(8), dice.choice((0, 3, 8))))


def test_a_bus_that_closes_is_told_in_one_line():
    with RuntimeDir() as private, Hub(private / "bus") as hub:
        receiver = start({"GNSS_HIL_BUS": f"embedded:{hub.path}"})
        until(lambda: hub.peers, receiver)
        hub.close()
        _, said = ended(receiver)
    assert receiver.returncode == 1
    assert said == "receiver: the hub closed the bus\n"


def test_another_contract_is_told_and_not_flown():
    """The receiver with its DBC, a flight software with the DBC of four receivers."""
    with RuntimeDir() as private, Hub(private / "bus") as hub:
        spec = f"embedded:{hub.path}"
        receiver = start({"GNSS_HIL_BUS": spec})
        words = ["--vehicle", "soyuz-ms", "--bus", spec, "--once", "--quiet"]
        flight = subprocess.Popen([*FLIGHT, *words])
        line = receiver.stderr.readline()
        assert receiver.poll() is None
        for process in (receiver, flight):
            process.terminate()
            process.wait()
    assert line == f"FLIGHT speaks contract {codec(4).hash:08x}, gnss.dbc is {codec(1).hash:08x}\n"


@pytest.mark.parametrize(
    ("told", "line"),
    [
        ({}, "GNSS_HIL_BUS is not set; for example embedded:/tmp/bus or socketcan:vcan0"),
        ({"GNSS_HIL_BUS": "embedded:/nowhere/bus"}, "bus 'embedded:/nowhere/bus': No such file or directory"),
        (
            {"GNSS_HIL_BUS": "embedded:/nowhere/bus", "GNSS_HIL_VEHICLE": str(find("soyuz-ms"))},
            f"{find('soyuz-ms')} has 4 antennas; this receiver has one",
        ),
    ],
)
def test_mistakes_are_one_line(told, line):
    process = start(told)
    _, said = ended(process)
    assert process.returncode == 1
    assert said.startswith(f"receiver: {line}") and said.count("\n") == 1


def loaded(name: str):
    """A module of the example, by its file."""
    spec = util.spec_from_file_location(name, EXAMPLE / f"{name}.py")
    module = util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


GPS, GLONASS, L1CA, RELEASE, TRACK, AUTONOMOUS = 0, 1, 0, 0, 1, 2


@pytest.mark.parametrize(
    ("result", "command"),
    [
        ("ACCEPTED", (0, TRACK, GPS, 7, L1CA)),
        ("ACCEPTED", (0, TRACK, GPS, 5, L1CA)),  # what the channel does already
        ("ACCEPTED", (1, TRACK, GPS, 6, L1CA)),  # taken from a channel that found it by itself
        ("ACCEPTED", (2, AUTONOMOUS, GPS, 0, L1CA)),
        ("NO_SUCH_CHANNEL", (3, TRACK, GPS, 7, L1CA)),
        ("NO_SUCH_SATELLITE", (0, TRACK, GPS, 25, L1CA)),
        ("NO_SUCH_SATELLITE", (0, TRACK, GPS, 0, L1CA)),
        ("NO_SUCH_SATELLITE", (0, TRACK, GLONASS, 7, L1CA)),
        ("ALREADY_TRACKED_HERE", (1, TRACK, GPS, 5, L1CA)),
        ("NO_SUCH_SIGNAL", (0, TRACK, GPS, 7, 2)),
        ("BAD_ACTION", (0, 3, GPS, 7, L1CA)),
    ],
)
def test_commands_are_answered_as_the_contract_says(result, command):
    """Channel 0 tracks satellite 5 by command, channel 2 satellite 6 by itself."""
    channels = loaded("channels").Channels(3)
    channels.sat, channels.commanded = [4, -1, 5], [True, False, False]
    before = list(channels.sat), list(channels.commanded)
    channel, action, system, number, signal = command
    answer = channels.obey(channel, action, system, number, signal, transaction=1)
    assert VALUES["AckResult"][answer] == result
    if answer:
        assert (channels.sat, channels.commanded) == before
    elif action == TRACK:
        assert channels.sat[channel] == number - 1 and channels.sat.count(number - 1) == 1
        assert channels.commanded[channel]


def test_free_channels_take_what_stands_highest_and_keep_it():
    channels = loaded("channels").Channels(2)
    above = np.full(24, -0.1)
    above[[3, 8, 9]] = 0.2, 0.5, 0.1
    assert channels.search(above) == [(0, 8), (1, 3)]
    above[9] = 0.9
    assert channels.search(above) == [(0, 8), (1, 3)]
    above[8] = -0.1
    assert channels.search(above) == [(0, 9), (1, 3)]
    channels.obey(1, RELEASE, GPS, 0, L1CA)
    above[8] = 0.5
    assert channels.search(above) == [(0, 9)]


def test_the_dbc_beside_it_is_the_benchs():
    assert (EXAMPLE / "gnss.dbc").read_text() == dbc_text(1)


def test_it_is_a_third_partys():
    """No module of the bench is imported, and each file is a page or two."""
    for file in EXAMPLE.glob("*.py"):
        text = file.read_text()
        nodes = [node for node in ast.walk(ast.parse(text))]
        names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
        assert not {name.partition(".")[0] for name in names} & {"dbc", "emulator", "flightsw", "tools"}, file
        assert text.count("\n") <= 120, file


def test_ends_of_lines_are_no_part_of_the_contract(tmp_path):
    for name in ("bench.py", "gnss.dbc"):
        (tmp_path / name).write_bytes((EXAMPLE / name).read_bytes().replace(b"\n", b"\r\n"))
    told = subprocess.run(
        [sys.executable, "-c", "import bench; print(bench.HASH)"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert told.stdout.strip() == str(codec(1).hash), told.stderr
