"""bus.log in the hands of other programs: cantools' command line and can-utils."""

from __future__ import annotations

import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.outside import can_utils
from tests.support.waiting import HANG_S

pytestmark = pytest.mark.verifies(
    "tools/recording/formats/candump.py",
    what="Recorded log",
    by="cantools' command line and can-utils' log2long read every line",
    status="validated",
)

LINES = 1500


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> list[bytes]:
    """The beginning of a run's log, past the first measurements."""
    folder = tmp_path_factory.mktemp("peers") / "run"
    assert main(["run", "--bus", "inline", "--duration", "45", "--out", str(folder), "--quiet"]) == 0
    return (folder / "bus.log").read_bytes().splitlines(keepends=True)[-LINES:]


def fed(command: list[str], log: list[bytes]) -> str:
    done = subprocess.run(command, input=b"".join(log), capture_output=True, timeout=HANG_S, check=True)
    return done.stdout.decode()


def test_cantools_decodes_every_frame_from_the_command_line(log):
    dbc = str(resources.files("gnss_hil.dbc.contract") / "gnss.dbc")
    text = fed([sys.executable, "-m", "cantools", "decode", "--single-line", dbc], log)
    lines = text.splitlines()
    assert len(lines) == len(log)
    assert all("::" in line and "Unknown" not in line and "failed" not in line for line in lines)
    assert any("RX1_RANGE(" in line and "pseudorange_m" in line for line in lines)


def test_can_utils_read_every_line(log):
    can_utils("log2long")
    lines = fed(["log2long"], log).splitlines()
    assert len(lines) == len(log)
    for ours, theirs in zip(log, lines, strict=True):
        stamp, bus, frame = ours.decode().split()
        can_id, payload = frame.split("#")
        words = theirs.split("'")[0].split()
        assert words[:4] == [stamp, bus, can_id, "[8]"]
        assert "".join(words[4:]) == payload


def test_the_log_survives_a_round_through_vectors_format(log, tmp_path):
    can_utils("log2asc", "asc2log")
    asc = Path(tmp_path / "bus.asc")
    asc.write_text(fed(["log2asc", "can0"], log))
    back = fed(["asc2log", "-I", str(asc)], []).splitlines()
    assert [line.split()[2] for line in back] == [line.decode().split()[2] for line in log]
