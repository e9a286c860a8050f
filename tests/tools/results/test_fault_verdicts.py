"""Faults of a run folder judged by its tables, against the tables read by Polars."""

from __future__ import annotations

import json
import subprocess
from xml.etree import ElementTree

import numpy as np
import polars
import pytest

from gnss_hil.emulator.faults.base import Direction
from gnss_hil.emulator.faults.checks import CHECKS
from gnss_hil.emulator.faults.files import of_line
from gnss_hil.emulator.faults.ledger import Stretch
from gnss_hil.emulator.faults.models import Expect
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.results import parquet
from gnss_hil.tools.results.assemble import antennas
from gnss_hil.tools.results.expectations import finding
from gnss_hil.tools.results.fault_verdicts import fixes_of, judge, seen_in
from tests.support.programs import GNSS_HIL

pytestmark = [
    pytest.mark.slow(seconds=3),
    pytest.mark.verifies(
        "tools/results/fault_verdicts.py",
        what="Faults: what became of them, by the tables",
        by="the tables of a run read again with Polars",
        status="validated",
    ),
]

LINES = (
    "ATT off @100+10 name=quiet detected_by=silence within_epochs=3 availability=0.9 fix_error_m=20",
    "rx1 RANGE crc wrong @115+5 name=crc detected_by=corrupted within_epochs=0 availability=1.0",
    "rx2 loss @500 name=never detected_by=lost",
    "rx3 loss @500 name=idle",
    "mark-jump 1h @127+2 name=jump fix_error_m=5",
)


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Run folder, exit status, stdout and stderr, verdict as JUnit has it."""
    path = tmp_path_factory.mktemp("faults")
    faults = [word for line in LINES for word in ("--fault", line)]
    command = [*GNSS_HIL, "run", "soyuz", "--duration", "130", "--bus", "inline", "--no-report"]
    told = ["--out", str(path / "run"), "--junit", str(path / "verdict.xml")]
    done = subprocess.run([*command, *faults, *told], capture_output=True, text=True)
    return path / "run", done, ElementTree.parse(path / "verdict.xml").getroot()


@pytest.fixture(scope="module")
def folder(played):
    return played[0]


def test_faults_are_judged_by_what_is_on_record(folder):
    rows = {one.fault: one for one in judge(folder, [of_line(line) for line in LINES], antennas(folder))}
    assert list(rows) == ["quiet", "crc", "never", "idle", "jump"]
    assert rows["never"].found is None and not rows["never"].met
    crc = rows["crc"]
    assert (crc.found.detected_by, crc.found.after_epochs, crc.met) == ("corrupted", 0, True)
    refused = polars.read_parquet(folder / "checks.parquet").filter(where="RX1_RANGE", by="BENCH")
    refused = refused["count"].sum()
    assert (crc.frames.refused, crc.frames.missing, crc.frames.let_through) == (refused, 0, 0)
    assert refused > crc.frames.touched == 30, "counters do not follow in the epoch behind"
    quiet = {one.key: one for one in rows["quiet"].verdicts}
    assert quiet["detected_by"].met and quiet["detected_by"].found.startswith("silence after")
    fixes = polars.read_parquet(folder / "fixes.parquet")
    share = fixes[100:110]["valid"].mean()
    assert rows["quiet"].found.availability == pytest.approx(share)
    assert rows["quiet"].frames.touched == rows["quiet"].frames.missing == 40


def test_a_miss_is_an_exit_status_a_line_and_a_failed_case_of_junit(played):
    _, done, suite = played
    assert done.returncode == 1
    never = "fault 'never' (rx2, craft soyuz) never acted: nothing of what was expected of it is met"
    assert done.stderr.splitlines() == [
        "gnss-hil: note: soyuz: the flight software answered 130 epochs, 128 NAV_STATUS are on record",
        "gnss-hil: note: fault 'idle' (rx3, craft soyuz) never acted: its window, trigger or place never "
        "came",
        f"gnss-hil: {never}",
    ]
    failures = {case.get("name"): case.find("failure") for case in suite.iter("testcase")}
    assert list(failures) == ["run", *(f"fault soyuz {name}" for name in ("quiet", "crc", "never", "jump"))]
    assert [name for name, failure in failures.items() if failure is not None] == ["fault soyuz never"]
    assert failures["fault soyuz never"].get("message") == never


def test_the_terminal_has_a_ledger(played):
    _, done, _ = played
    head, *lines = done.stdout[done.stdout.index("fault  ") :].splitlines()[:6]
    assert head.split()[:5] == ["fault", "kind", "place", "acted", "seen"]
    words = {line.split()[0]: line.split() for line in lines}
    assert words["quiet"][1:8] == ["silence", "ATT", "100..109", "attitude", "0", "silence", "0"]
    assert words["quiet"][-1] == "met" and words["never"][-1] == "MISSED"
    assert words["never"][3] == words["idle"][3] == "never"


def test_the_summary_and_the_table_have_what_became_of_each_fault(folder):
    rows = {row["fault"]: row for row in json.loads((folder / "summary.json").read_text())["faults"]}
    table = polars.read_parquet(folder / "faults.parquet")
    assert set(table["fault"]) == {"quiet", "crc", "jump"}
    for found in table.iter_rows(named=True):
        row = rows[found["fault"]]
        for name in ("detected_by", "after_epochs", "expected_by", "expected_after_epochs"):
            assert found[name] == row[name]
        assert found["fix_error_m"] == pytest.approx(row["fix_error_m"]) and found["met"] is row["met"]
    assert rows["never"]["first_epoch"] is None and not rows["never"]["met"]
    assert {one["found"] for one in rows["never"]["expectations"]} == {"never acted"}


def test_a_report_made_again_misses_the_same(folder):
    before = (folder / "faults.parquet").read_bytes(), (folder / "summary.json").read_bytes()
    done = subprocess.run([*GNSS_HIL, "report", str(folder)], capture_output=True, text=True)
    assert done.returncode == 1 and "fault 'never' (rx2, craft soyuz) never acted" in done.stderr
    assert before == ((folder / "faults.parquet").read_bytes(), (folder / "summary.json").read_bytes())


def test_errors_are_against_the_truth_of_the_epoch(folder):
    found = fixes_of(folder, "soyuz")
    fixes, truth = (polars.read_parquet(folder / f"{name}.parquet") for name in ("fixes", "truth"))
    axes = ["x_ecef_m", "y_ecef_m", "z_ecef_m"]
    both = fixes.filter(polars.col("valid")).join(truth, on="t_gps_s", suffix="_true").head(100)
    apart = both[axes].to_numpy() - both[[f"{axis}_true" for axis in axes]].to_numpy()
    assert found.error_m[found.valid][:100] == pytest.approx(np.linalg.norm(apart, axis=1))
    assert np.isnan(found.error_m[~found.valid]).all()


def test_checks_have_the_names_of_the_bench(folder):
    checks, signs = polars.read_parquet(folder / "checks.parquet"), seen_in(folder, "soyuz").signs
    seen = {word: {e for one in signs if one.word == word for e in one.epochs.tolist()} for word in CHECKS}
    corrupted = checks.filter(check="CORRUPTED")["epoch"].unique().to_list()
    assert seen["corrupted"] == set(corrupted)
    assert seen["silence"] and seen["mark"] and not seen["restart"]


def test_frames_behind_a_fault_are_not_those_it_touched(tmp_path):
    """A node that starts anew has other counters for good: frames of the attitude, four in each epoch."""
    run, line = tmp_path / "run", "ATT restart @10+3"
    more = ["--duration", "20", "--bus", "inline", "--no-report", "--quiet", "--out", str(run)]
    assert main(["run", "soyuz", "--fault", line, *more]) == 0
    (one,) = judge(run, [of_line(line)], antennas(run))
    assert (one.frames.touched, one.frames.missing) == (3 * 4, 3 * 4)
    assert polars.read_parquet(run / "faults.parquet")["frames_touched"].sum() == (3 + 7) * 4


def test_values_that_no_bits_can_carry_are_told(tmp_path, capsys):
    run = tmp_path / "run"
    more = ["--duration", "20", "--bus", "inline", "--no-report", "--quiet", "--out", str(run)]
    lines = ["ATT_Q01.q0 += 2.05 @10+3 name=far", "ATT_RATE.wx_rps += 0.001 @10+3 name=near"]
    assert main(["run", "soyuz", *(word for one in lines for word in ("--fault", one)), *more]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "the signal can carry" in line]
    assert told == [
        "gnss-hil: note: fault 'far' (all, craft soyuz): 3 values led out of what the signal can carry; the "
        "nearest that it can was sent"
    ]
    table = polars.read_parquet(run / "faults.parquet")
    assert table["values_clipped"].to_list() == [3, 0]


def test_a_fix_errs_against_the_truth_at_the_time_that_its_mark_shows(tmp_path):
    """A craft that goes along x by 7,500 m/s, in fixes that are where it is in their epoch: as marks were,
    0.3 s and 1 s ahead, and 1,024 weeks back, where nobody knows."""
    craft, none = parquet.Labelled(np.zeros(5, np.uint8), ("a",)), np.zeros(5)
    t_s = 1e9 + np.arange(5.0)
    moves = {"x_ecef_m": 7500 * np.arange(5.0), "y_ecef_m": none, "z_ecef_m": none}
    speed = {f"v{axis}_ecef_mps": none + (7500 if axis == "x" else 0) for axis in "xyz"}
    parquet.write(tmp_path / "truth.parquet", [{"craft": craft, "t_gps_s": t_s, **moves, **speed}])
    shown = t_s + np.array([0, 0.3, 1, -1024 * 604_800, 0])
    valid = np.array([True, True, True, True, False])
    fixes = {"craft": craft, "t_gps_s": shown, "epoch": np.arange(5), "valid": valid, **moves}
    parquet.write(tmp_path / "fixes.parquet", [fixes])
    found = fixes_of(tmp_path, "a")
    assert found.error_m[0] == 0.0 and found.error_m[1:3] == pytest.approx([2250, 7500], abs=0.01)
    assert np.isnan(found.error_m[3:]).all()
    judged = finding(Expect(), [Stretch(0, 0, Direction.FLIGHT, True, 1, 4, 4, 4, struck=1)], found, [])
    assert (judged.fix_error_m, judged.fixes_unjudged) == (pytest.approx(7500), 1)
    (tmp_path / "truth.parquet").unlink()
    assert np.isnan(fixes_of(tmp_path, "a").error_m).all(), "without a truth"


def test_what_another_fault_did_does_not_meet_what_is_expected_of_one(tmp_path, capsys):
    """A receiver that is off when the wrong CRCs of another are long over; and one that is silent, and does
    not restart in time."""
    lines = (
        "rx1 RANGE crc wrong @70+2 detected_by=silence name=crc",
        "rx2 off @80+5 detected_by=silence name=off",
        "rx2 off @100+5 detected_by=restart within_epochs=1 name=again",
        "rx3 RANGE crc wrong @100+4 detected_by=silence name=beside",
    )
    faults = [word for line in lines for word in ("--fault", line)]
    more = ["--duration", "115", "--bus", "inline", "--no-report", "--quiet", "--out", str(tmp_path / "run")]
    verdict = tmp_path / "verdict.xml"
    assert main(["run", "soyuz", *faults, *more, "--junit", str(verdict)]) == 1
    crc, off, again, beside = json.loads((tmp_path / "run" / "summary.json").read_text())["faults"]
    assert (crc["detected_by"], crc["expected_by"], crc["met"]) == ("corrupted", None, False)
    assert (off["detected_by"], off["expected_by"], off["met"]) == ("silence", "silence", True)
    assert (again["detected_by"], again["after_epochs"], again["met"]) == ("silence", 0, False)
    assert (beside["detected_by"], beside["expected_by"]) == ("corrupted", None), "silence is of rx2"
    said = {case.get("name"): case.find("failure") for case in ElementTree.parse(verdict).iter("testcase")}
    assert (
        said["fault soyuz again"]
        .get("message")
        .endswith("detected_by: only silence after 0 epochs, expected restart within 1 epoch")
    )
    assert said["fault soyuz off"] is None


def test_what_is_refused_elsewhere_is_not_of_a_fault(tmp_path):
    """Two faults at a time, whose wrong CRCs are all refused: each has its own."""
    lines = ("rx1 RANGE crc wrong @40+4 name=one", "rx2 RANGE,RATE crc wrong @42+4 name=two")
    more = ["--duration", "55", "--bus", "inline", "--no-report", "--quiet", "--out", str(tmp_path / "run")]
    assert main(["run", "soyuz", *(word for line in lines for word in ("--fault", line)), *more]) == 0
    checks = polars.read_parquet(tmp_path / "run" / "checks.parquet").filter(by="BENCH")
    of = [
        checks.filter(polars.col("where").is_in(names), polars.col("epoch").is_between(first, last))[
            "count"
        ].sum()
        for names, first, last in ((["RX1_RANGE"], 40, 47), (["RX2_RANGE", "RX2_RATE"], 42, 49))
    ]
    judged = judge(tmp_path / "run", [of_line(line) for line in lines], antennas(tmp_path / "run"))
    assert [one.frames.refused for one in judged] == of and min(of) > 0
    assert sum(of) <= checks["count"].sum()
