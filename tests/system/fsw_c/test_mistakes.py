"""What the flight software in C says of mistakes, and how it ends."""

from __future__ import annotations

import os
import subprocess

import pytest

from gnss_hil.dbc.bus.hub import Hub
from gnss_hil.dbc.common.vehicle import find
from gnss_hil.dbc.contract.codec import codec
from tests.support.feeder import Feeder
from tests.support.fsw_c import EXAMPLE
from tests.support.outside import c_tools
from tests.support.waiting import ended, until

pytestmark = pytest.mark.verifies(what="Assignment and commands, a second time")


SHIPPED = find("soyuz-ms")
GOOD, TWO = SHIPPED.read_text(), find("soyuz-ms-l1l2").read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD.replace("channels = 6", "channels = 33", 1), "channels: found 33, allowed is a whole number"),
        (GOOD.replace("receiver = 2", "receiver = 1"), "two antennas have the same receiver"),
        (GOOD.replace("mask_deg = 85.0\n", "", 1), "an antenna needs name, receiver, channels"),
        (GOOD.replace("mask_deg = 85.0", "mask_deg = nan", 1), "mask_deg: found nan, allowed is an angle"),
        (GOOD.replace("[0.573576436351046, 0.0,", "[0.9, 0.0,", 1), "allowed is three numbers of length 1"),
        (GOOD.replace("channels = 6", "chanels = 6", 1), "chanels: unknown key"),
        (GOOD.replace("channels = 6", "channels = 6\nchannels = 6", 1), "this key was given before"),
        (TWO.replace('["L2C", "L2OF"]', '["L2C" "L2OF"]', 1), "other_signals: found"),
        (TWO.replace('["L2C", "L2OF"]', '["L2C", L2OF]', 1), "allowed is names of signals in brackets"),
        (TWO.replace('["L2C", "L2OF"]', '["L2C"', 1), "other_signals: found"),
        (GOOD.split("[[antenna]]")[0], "no [[antenna]]"),
        (GOOD.rsplit("[[antenna]]", 1)[0], "3 antennas; this program was built for 4 (make RECEIVERS=3)"),
        ("\0\xff" * 300, "longer than 510 characters"),
    ],
)  # fmt: skip
def test_a_vehicle_file_with_a_fault_is_one_clear_line(sanitized, tmp_path, text, words):
    path = tmp_path / "vehicle.toml"
    path.write_bytes(text.encode("latin-1"))
    done = subprocess.run(
        [sanitized, "--bus", "embedded:/nowhere/bus", "--vehicle", path], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.startswith(f"fsw: {path}, line ") and words in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ([], 2, "no bus: give --bus or set GNSS_HIL_BUS"),
        (["--bus", "embedded:/x"], 2, "no vehicle file: give --vehicle or set GNSS_HIL_VEHICLE"),
        (["--bus"], 2, "--bus needs a value (see --help)"),
        (["--colour"], 2, "unknown argument '--colour' (see --help)"),
        (["--bus", "embedded:/x", "--vehicle", "/nowhere"], 2, "vehicle file /nowhere: No such file"),
        (["--bus", "embedded:/x/y", "--vehicle", SHIPPED], 3, "bus embedded:/x/y: No such file"),
        (["--bus", "embedded:/x/y", "--vehicle", find("soyuz-ms-l1l2")], 3, "bus embedded:/x/y: No such"),
        (["--bus", "socketcan:can9", "--vehicle", SHIPPED], 3, "bus socketcan:can9: no such CAN"),
        (["--bus", "usb:1", "--vehicle", SHIPPED], 3, "allowed are embedded:PATH and socketcan:"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_clear_line(fsw, arguments, status, words):
    bare = {name: value for name, value in os.environ.items() if not name.startswith("GNSS_HIL")}
    done = subprocess.run([fsw, *arguments], capture_output=True, text=True, env=bare)
    assert (done.returncode, done.stdout) == (status, "")
    assert done.stderr.startswith("fsw: ") and words in done.stderr and done.stderr.count("\n") == 1


def test_a_bus_that_nobody_serves_yet_is_waited_for(fsw, tmp_path):
    bus = f"embedded:{tmp_path / 'bus'}"
    process = subprocess.Popen([fsw, "--bus", bus, "--vehicle", SHIPPED], stderr=subprocess.PIPE, text=True)
    assert process.stderr.readline() == f"fsw: waiting for a bus at {bus}\n"
    with Hub(tmp_path / "bus") as hub:
        until(lambda: hub.joined, process)
        process.send_signal(2)
        assert ended(process) == (None, "") and process.returncode == 130


def test_an_interrupt_ends_the_wait(fsw, tmp_path):
    bus = f"embedded:{tmp_path / 'bus'}"
    process = subprocess.Popen([fsw, "--bus", bus, "--vehicle", SHIPPED], stderr=subprocess.PIPE, text=True)
    assert "waiting" in process.stderr.readline()
    process.send_signal(2)
    assert ended(process) == (None, "") and process.returncode == 130


def test_an_interrupt_ends_it(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        bench.play(epochs[0])
        bench.process.send_signal(2)
        assert bench.leave() == (130, "")


def test_a_bus_that_goes_away_during_a_run_is_a_failure(fsw, epochs, tmp_path):
    with Feeder(fsw, tmp_path) as bench:
        bench.play(epochs[0])
        bench.bus.close()
        assert bench.leave()[0] == 1


def test_ends_of_lines_are_no_part_of_the_contract(tmp_path):
    c_tools("make", "sha256sum")
    dbc = tmp_path / "crlf.dbc"
    dbc.write_bytes(codec(4).text.replace("\n", "\r\n").encode("ascii"))
    target = tmp_path / "build" / "contract_hash.h"
    made = ["make", "-C", EXAMPLE, f"BUILD={target.parent}", f"DBC={dbc}", target]
    done = subprocess.run(list(map(str, made)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"CONTRACT_HASH 0x{codec(4).hash:08x}U" in target.read_text()
    assert "CONTRACT_RECEIVERS 4" in target.read_text()
