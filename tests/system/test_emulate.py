"""gnss-hil emulate: the emulator of a changed scenario, on a bus with our flight software."""

from __future__ import annotations

import subprocess

from gnss_hil.dbc.bus.runtime_dir import RuntimeDir
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.processes.bus_tap import BusTap, embedded_bus
from tests.support.programs import FLIGHT, GNSS_HIL
from tests.support.runs import summary_of
from tests.support.waiting import ended

CHANGES = (
    "--set", "craft.0.orbit.altitude_km=500", "--off", "code_noise", "--interval", "2", "--duration", "20",
)  # fmt: skip
ATTITUDE = range(0x060, 0x063)
"""Identifiers of frames that tell the orbit, and no session."""


def test_it_plays_what_run_plays_with_the_same_words(tmp_path):
    """The frames of the time marks and receivers are those of the run."""
    assert main(["run", "soyuz", "--bus", "inline", "--out", str(tmp_path / "run"), "--quiet", *CHANGES]) == 0
    assert summary_of(tmp_path / "run")["epochs"] == 10
    tap = BusTap()
    with RuntimeDir() as private, embedded_bus(private / "bus", tap) as bus:
        flight = subprocess.Popen(
            [*FLIGHT, "--bus", bus, "--vehicle", "soyuz-ms", "--once", "--quiet"],
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        told = subprocess.Popen(
            [*GNSS_HIL, "emulate", "soyuz", "--bus", bus, *CHANGES], stderr=subprocess.PIPE, text=True
        )
        _, err = ended(told)
        ended(flight)
        assert told.returncode == 0, err
        frames = concat(frames for _, frames in tap.take())
    assert "completed after 10 epochs, 0 unanswered" in err
    heard = zip(frames.can_id.tolist(), frames.data, strict=True)
    said = {(i, data.tobytes()[2:]) for i, data in heard if i in ATTITUDE}
    recorded = (
        line.split()[2].split("#") for line in (tmp_path / "run" / "bus.log").read_text().splitlines()
    )
    kept = ((int(i, 16), bytes.fromhex(data)[2:]) for i, data in recorded)
    assert said == {(i, data) for i, data in kept if i in ATTITUDE}
    assert len(said) > 10
