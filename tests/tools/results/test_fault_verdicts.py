"""Faults of a run folder judged by its tables, against the tables read by Polars."""

from __future__ import annotations

import subprocess

import numpy as np
import polars
import pytest

from gnss_hil.emulator.faults.files import of_line
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
    "mark-jump 1h @122+2 name=jump fix_error_m=5",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("faults") / "run"
    faults = [word for line in LINES for word in ("--fault", line)]
    command = [*GNSS_HIL, "run", "soyuz", "--duration", "130", "--bus", "inline", "--quiet", "--no-report"]
    subprocess.run([*command, *faults, "--out", str(path)], check=True, capture_output=True)
    return path


def test_faults_are_judged_by_what_is_on_record(folder):
    rows = {one.fault: one for one in judge(folder, [of_line(line) for line in LINES])}
    assert list(rows) == ["quiet", "crc", "never", "jump"]
    assert rows["never"].found is None and not rows["never"].met
    crc = rows["crc"]
    assert (crc.found.detected_by, crc.found.after_epochs, crc.met) == ("corrupted", 0, True)
    quiet = {one.key: one for one in rows["quiet"].verdicts}
    assert quiet["detected_by"].met and quiet["detected_by"].found.startswith("silence after")
    fixes = polars.read_parquet(folder / "fixes.parquet")
    share = fixes[100:110]["valid"].mean()
    assert rows["quiet"].found.availability == pytest.approx(share)


def test_errors_are_against_the_truth_of_the_epoch(folder):
    found = fixes_of(folder, "soyuz")
    fixes, truth = (polars.read_parquet(folder / f"{name}.parquet") for name in ("fixes", "truth"))
    axes = ["x_ecef_m", "y_ecef_m", "z_ecef_m"]
    both = fixes.filter(polars.col("valid")).join(truth, on="t_gps_s", suffix="_true").head(100)
    apart = both[axes].to_numpy() - both[[f"{axis}_true" for axis in axes]].to_numpy()
    assert found.error_m[found.valid][:100] == pytest.approx(np.linalg.norm(apart, axis=1))
    assert np.isnan(found.error_m[~found.valid]).all()


def test_checks_have_the_names_of_the_bench(folder):
    seen, checks = seen_in(folder, "soyuz"), polars.read_parquet(folder / "checks.parquet")
    assert sorted(seen["corrupted"].tolist()) == sorted(checks.filter(check="CORRUPTED")["epoch"].to_list())
    assert {"silence", "corrupted"} <= seen.keys()
