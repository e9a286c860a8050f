"""The tables of a run folder against bus.log as cantools reads it: no codec, no digest of ours between."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import polars as pl
import pytest

from tests.support import buslog

pytestmark = pytest.mark.verifies(
    "tools/decoder/digest.py",
    "tools/decoder/decoder.py",
    "tools/decoder/block.py",
    "tools/decoder/channels.py",
    "tools/decoder/navigation.py",
    "tools/results/tables.py",
    "tools/decoder/command_log.py",
    "tools/results/assemble.py",
    "tools/results/run_digest.py",
    "tools/results/parquet.py",
    what="Tables of a run: fixes, channels, commands",
    by="cantools, every epoch of a run's log",
    status="validated",
)

AXES = ("x", "y", "z")
DBC = Path(str(resources.files("gnss_hil.dbc.contract") / "gnss.dbc"))


@pytest.fixture(scope="module")
def epochs(inline):
    return buslog.read(inline / "bus.log", DBC)


def test_fixes_are_what_cantools_reads(inline, epochs):
    fixes = pl.read_parquet(inline / "fixes.parquet").to_dicts()
    assert len(fixes) == len(epochs)
    for row, epoch in zip(fixes, epochs, strict=True):
        status = epoch.signals["NAV_STATUS"]
        assert (row["mode"], row["satellites"]) == (str(status["mode"]), status["satellites"])
        assert row["valid"] == (row["mode"] != "NO_FIX")
        if row["valid"]:
            assert row["pdop"] == pytest.approx(status["pdop"])
            said = [epoch.signals[f"NAV_{axis.upper()}"][f"{axis}_m"] for axis in AXES]
            assert [row[f"{axis}_ecef_m"] for axis in AXES] == pytest.approx(said, abs=1e-6)
    assert sum(row["valid"] for row in fixes) > 20


def test_channels_are_what_cantools_reads(inline, epochs):
    table = pl.read_parquet(inline / "channels.parquet")
    start_s = pl.read_parquet(inline / "fixes.parquet")["t_gps_s"][0]
    seen = 0
    for row in table.iter_rows(named=True):
        epoch = epochs[round(row["t_gps_s"] - start_s)]
        said = epoch.channels[row["receiver"], row["channel"]]
        assert row["satellite"] == buslog.sat_name(said)
        for name in ("pseudorange_m", "range_rate_mps", "cn0_dbhz"):
            assert row[name] == pytest.approx(said[name], abs=1e-6), name
        used = epoch.used.get(row["receiver"], 0) >> row["channel"] & 1
        assert row["used"] == bool(used)
        seen += 1
    complete = sum(len(epoch.channels) for epoch in epochs)
    assert seen == complete > 300


def test_commands_are_what_cantools_reads(inline, epochs):
    events = pl.read_parquet(inline / "assignments.parquet")
    sent = events.filter(pl.col("event").is_in(["command", "repeat"]))
    said = [(receiver, c["channel"]) for epoch in epochs for receiver, c in epoch.commands]
    assert sorted(zip(sent["receiver"], sent["channel"], strict=True)) == sorted(said)
    answers = [(receiver, a["channel"], str(a["result"])) for epoch in epochs for receiver, a in epoch.acks]
    acks = events.filter(pl.col("event") == "ack")
    assert sorted(zip(acks["receiver"], acks["channel"], acks["result"], strict=True)) == sorted(answers)
    assert len(said) >= 24 <= len(answers)
