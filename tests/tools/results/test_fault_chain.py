"""The chain from frame to fix: what a run's tables make of it, against Polars."""

from __future__ import annotations

import json

import polars
import pytest

from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.results.fault_chain import NO_FIX_MADE, OTHERWISE, Stage, chain

pytestmark = pytest.mark.verifies(
    "tools/results/fault_chain.py",
    what="Faults: how far they came, from frame to fix",
    by="the tables of a run read again with Polars",
    status="validated",
)

LINES = (
    "rx2 crc wrong @100+4",
    "rx1 loss @110+4",
    "G07 range +30 m @105+2",
    "mark-missing @120+2",
    "ATT loss @1h",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "run"
    faults = [word for line in LINES for word in ("--fault", line)]
    more = ["--duration", "130", "--bus", "inline", "--no-report", "--quiet", "--out", str(path)]
    assert main(["run", "soyuz", *faults, *more]) == 0
    return path


@pytest.fixture(scope="module")
def stages(folder) -> dict[str, Stage]:
    summary = json.loads((folder / "summary.json").read_text())
    return {one.name: one for one in chain(folder, "soyuz", summary["faults"], summary["epochs"])}


OWN = polars.col("epoch").is_in([*range(100, 109), *range(110, 118), *range(120, 124)])
"""Epochs in which a fault acts and as many behind; those of the range step are among them."""


def test_frames_are_those_of_the_ledger(folder, stages):
    table = polars.read_parquet(folder / "faults.parquet")
    touched, missing = table["frames_touched"].sum(), table["frames_missing"].sum()
    assert (stages["frames touched"].came, stages["frames touched"].goes_on) == (touched, touched - missing)


def test_frames_are_refused_by_the_checks_of_their_epochs(folder, stages):
    checks = polars.read_parquet(folder / "checks.parquet").filter(OWN, by="BENCH")
    counts = checks.group_by("check").agg(polars.col("count").sum())
    refused = {k: n for k, n in counts.iter_rows() if k in ("CORRUPTED", "WRONG_SEQUENCE", "MIXED_EPOCH")}
    assert stages["frames at the checks"].ended == refused and refused["CORRUPTED"] > 100


def test_measurements_and_epochs_are_all_accounted_for(folder, stages):
    epochs = polars.read_parquet(folder / "epochs.parquet").filter(OWN)
    channels = polars.read_parquet(folder / "channels.parquet").join(epochs, on="t_gps_s")
    found = stages["measurements"]
    assert (found.came, found.goes_on) == (len(channels), int(channels["used"].sum()))
    assert found.ended["contradict the rest"] == 2 and not {NO_FIX_MADE, OTHERWISE} & {*found.ended}
    fixes = polars.read_parquet(folder / "fixes.parquet").join(epochs, on="t_gps_s").filter("valid")
    assert (stages["epochs"].came, stages["epochs"].goes_on) == (9 + 8 + 4, len(fixes))
    assert sum(stages["epochs"].ended.values()) >= 2, "those without a mark have no fix"


def test_without_a_fault_that_acted_there_is_no_chain(folder):
    assert chain(folder, "soyuz", [], 130) == []
    summary = json.loads((folder / "summary.json").read_text())
    assert chain(folder, "soyuz", summary["faults"][-1:], 130) == []
