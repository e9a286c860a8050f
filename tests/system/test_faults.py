"""Faults in runs: the library flown, the same on every bus, nothing changed where there are none."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import polars
import pytest

from gnss_hil.emulator.faults import files
from gnss_hil.emulator.faults.kinds.registry import KINDS
from gnss_hil.emulator.faults.kinds.row import RUN
from tests.support.faulted import by_cantools, of_kind, play, undisturbed
from tests.support.programs import GNSS_HIL
from tests.support.runs import sha

pytestmark = [
    pytest.mark.slow,
    pytest.mark.verifies(
        "tools/processes/inline_bus.py",
        what="Faults: the same frames on every bus",
        by="SHA-256 of runs inline and over a real embedded bus",
        status="validated",
    ),
]

ROWS_OF = {
    name: [KINDS[one.kind] for one in files.load(path).fault] for name, path in files.shipped().items()
}
FLOWN = [name for name, rows in ROWS_OF.items() if all(RUN in row.links and row.frames for row in rows)]


@pytest.mark.parametrize("name", FLOWN)
def test_every_file_of_the_library_is_flown_and_does_what_its_kind_says(name):
    """Undisturbed up to the window; in it, frames are touched; no exception on either side."""
    acted, touched = [], 0
    for epoch, (block, answer, events) in enumerate(play(130, files=[name])):
        touched += sum(event.touched for event in events)
        if any(event.touched for event in events):
            acted.append(epoch)
        if not acted:
            assert (block, answer) == undisturbed()[epoch]
    assert touched and acted
    (fault,) = files.load(files.shipped()[name]).fault
    assert acted[0] >= float(fault.at.start) - 1


def test_a_jammer_is_on_in_its_window_alone():
    """GPS on L1 is lost at once and back when it is over; GLONASS, on other carriers, stays."""

    def tracked(block) -> list[int]:
        systems = [row["sat_system"] for row in by_cantools(of_kind(block, "SV_CLOCK"))]
        return [systems.count(0), systems.count(1)]

    for epoch, (block, _, events) in enumerate(play(130, files=["jammer"])):
        gps, glonass = tracked(undisturbed()[epoch][0])
        on = 100 <= epoch < 108
        assert tracked(block) == [0 if on else gps, glonass], epoch
        assert bool(events) is on


def run(folder: Path, *more: str, duration: int = 130, status: int | None = 0) -> subprocess.CompletedProcess:
    command = [
        *GNSS_HIL,
        "run",
        "soyuz",
        "--duration",
        str(duration),
        "--quiet",
        "--no-report",
        "--out",
        str(folder),
    ]
    done = subprocess.run([*command, *more], capture_output=True, text=True)
    assert status in (None, done.returncode), done.stderr
    return done


@pytest.mark.parametrize(
    "fault",
    [
        "mark-missing",
        "mark-late",
        "second-time-master",
        "second-flight-computer",
        "stray-bench",
        "receiver-off",
    ],
)
def test_the_same_record_inline_and_on_a_bus(tmp_path, fault):
    for bus in ("inline", "embedded"):
        run(tmp_path / bus, "--bus", bus, "--faults", fault, status=None)  # of what is expected: elsewhere
    assert sha(tmp_path / "inline") == sha(tmp_path / "embedded")
    assert (tmp_path / "inline" / "faults").read_bytes() == (tmp_path / "embedded" / "faults").read_bytes()


def test_without_a_fault_that_acts_no_byte_changes(tmp_path):
    run(tmp_path / "plain", "--bus", "inline")
    run(tmp_path / "armed", "--fault", "rx2 off @1h", "--fault", "all loss @1h")
    assert sha(tmp_path / "plain") == sha(tmp_path / "armed")
    assert not (tmp_path / "plain" / "faults.parquet").exists()


def test_a_run_with_faults_has_a_ledger_and_can_be_played_again(tmp_path):
    faults = ["--fault", "rx2 off @2m+5s name=off", "--fault", "G07 range +30 m @100+10"]
    run(tmp_path / "run", *faults)
    table = polars.read_parquet(tmp_path / "run" / "faults.parquet")
    off, step = (table.filter((polars.col("kind") == kind) & (polars.col("direction") == "flight"))
                 for kind in ("receiver-off", "range-step"))  # fmt: skip
    found = off.row(0, named=True)
    assert found["frames_touched"] == found["frames_missing"] > 0
    assert found | {"frames_touched": 0, "frames_missing": 0, "fix_error_m": 0} == {
        "craft": "soyuz", "fault": "off", "kind": "receiver-off", "place": "rx2", "direction": "flight",
        "active": True, "first_epoch": 120, "last_epoch": 124, "epochs": 5, "frames_touched": 0,
        "frames_missing": 0, "values_clipped": 0, "detected_by": "silence", "after_epochs": 0,
        "fix_error_m": 0,
        "availability": 1.0, "met": None, "first_struck": 120, "expected_by": None,
        "expected_after_epochs": None, "fixes_unjudged": 0,
    }  # fmt: skip
    assert step["frames_touched"].to_list() == [20], "range and phase of one channel, ten epochs"
    facts = json.loads((tmp_path / "run" / "run.json").read_text())
    assert [one["kind"] for one in facts["faults"][0]["faults"]] == ["receiver-off", "range-step"]
    again = [
        *GNSS_HIL,
        "run",
        str(tmp_path / "run" / "scenario.toml"),
        "--quiet",
        "--no-report",
        "--bus",
        "inline",
    ]
    subprocess.run([*again, "--out", str(tmp_path / "again")], check=True, capture_output=True)
    assert sha(tmp_path / "again") == sha(tmp_path / "run")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--fault", "rx2 of"], "--fault 'rx2 of': 'of' is no kind of fault; did you mean 'off'?"),
        (
            ["--fault", "rx2 asymmetric"],
            "--fault 'rx2 asymmetric': asymmetric: run cannot do it: everybody on one bus hears the same",
        ),
        (
            ["--fault", "rx2 off", "--emulator", "external"],
            "fault: receiver-off: our emulator applies faults",
        ),
        (["--faults", "replay", "--fault", "ch9 loss"], "--fault 'ch9 loss': loss: on: no channel ch9"),
        (["--faults", "replai"], "fault file 'replai': no such file; shipped are"),
    ],
)
def test_a_mistake_starts_nothing(tmp_path, arguments, words):
    done = run(tmp_path / "run", *arguments, status=2)
    assert words in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "run").exists()
