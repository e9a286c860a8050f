"""What a new sensor node takes: rows of the contract, a file with its row, the registry. Scenario keys,
frames, protection and heartbeat follow; recorder, decoder and flight software do not mind."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gnss_hil.dbc.contract import e2e
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.recording.formats.candump import read_chunks
from tests.support import emulated

pytestmark = pytest.mark.verifies(
    "emulator/sensors/attitude.py",
    "emulator/sensors/base.py",
    "emulator/sensors/frames.py",
    "emulator/sensors/params.py",
    "emulator/sensors/registry.py",
    "emulator/environment/epoch_frames.py",
    what="Sensor nodes as rows",
    by="a sensor of the tests' own: when its records come, their values, headers and heartbeat",
    status="modelled",
)

ROOT = Path(__file__).parents[3]
TILT, HEARTBEAT, STEP_DEG = 0x070, 0x700 + 11, 0.01
EPOCHS, SAMPLES = 70, 2

SCENARIO = """
name = "sensors"
[time]
start_gps = "2012-10-31T00:15:00"
duration_s = 70
[[craft]]
name = "soyuz"
vehicle = "soyuz-ms.toml"
orbit = { altitude_km = 415, inclination_deg = 51.6 }
[craft.sensors]
clinometer = { antenna = 1, every = 5, samples = 2 }
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sensors")
    (folder / "sensors.toml").write_text(SCENARIO)
    command = [sys.executable, "-m", "tests.support.made_up_sensor", str(folder / "sensors.toml")]
    done = subprocess.run(
        [*command, "--bus", "inline", "--quiet", "--out", str(folder / "run")],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "run"


@pytest.fixture(scope="module")
def frames(run):
    with (run / "bus.log").open("rb") as log:
        return concat([batch for _, _, batch, _ in read_chunks(log, "bus.log")])


def test_its_records_are_on_the_bus_in_their_epochs(frames):
    """Two samples in every fifth epoch: the bearing of the antenna, which looks to the side in orbital
    attitude, so nearly level; the counter goes on within an epoch and over the block's end."""
    mine = frames.can_id == TILT
    words = np.ascontiguousarray(frames.data[mine]).view("<u8")[:, 0]
    assert len(words) == SAMPLES * EPOCHS // 5
    assert ((words >> np.uint64(16)) & np.uint64(31) == 1).all()
    assert ((words >> np.uint64(37)) & np.uint64(255)).tolist() == [0, 1] * (EPOCHS // 5)
    tilt_deg = STEP_DEG * ((words >> np.uint64(21)) & np.uint64(0xFFFF)).astype(float)
    boresight = emulated.VEHICLE.boresight_body[1]
    expected_deg = np.rad2deg(np.arccos(-boresight[2]))  # body z is nadir
    assert tilt_deg == pytest.approx(np.full(len(words), expected_deg), abs=0.3)
    assert (frames.data[mine, 1] & 15).tolist() == [k % e2e.COUNTERS for k in range(len(words))]


def test_they_follow_the_attitude_and_come_before_the_receivers(frames):
    contract = codec(4)
    marks = np.flatnonzero(frames.can_id == contract.can_id_of["TIME_MARK", 0])
    opening = frames.can_id[marks[5] : marks[6]].tolist()
    of_attitude = [contract.can_id_of[kind, 0] for kind in ("ATT_Q01", "ATT_Q23", "ATT_RATE")]
    first = opening.index(of_attitude[0])
    assert opening[first : first + 5] == [*of_attitude, TILT, TILT]
    assert TILT not in frames.can_id[marks[6] : marks[7]].tolist()


def test_its_node_has_a_heartbeat(frames):
    assert np.count_nonzero(frames.can_id == HEARTBEAT) == EPOCHS


def test_flight_software_and_tables_do_not_mind(run):
    """Nothing is refused, fixes are there as without it."""
    summary = json.loads((run / "summary.json").read_text())
    assert summary["frames"]["rejected"] == {} and summary["frames"]["lost"] == 0
    assert summary["craft"]["soyuz"]["fixes"] > 20
    assert summary["craft"]["soyuz"]["position_error_m"]["median"] < 30


def test_a_craft_without_its_attitude_unit_sends_none():
    blocks = emulated.run(emulated.world(emulated.craft(sensors={"attitude": False})), 2)[1]
    contract = codec(4)
    gone = {contract.can_id_of[kind, 0] for kind in ("ATT_Q01", "ATT_Q23", "ATT_RATE")} | {
        contract.can_id_of["HEARTBEAT", 9]
    }
    assert not gone & set(blocks[-1].can_id.tolist())
    assert {contract.can_id_of["TIME_MARK", 0]} < set(blocks[-1].can_id.tolist())
