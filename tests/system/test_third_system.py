"""A third satellite system flies end to end from rows of a test's own tables, no product file touched."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import concat
from gnss_hil.emulator.files import rinex_nav
from gnss_hil.tools.recording.formats.candump import read_chunks
from tests.support.third_system import K1, KEPLER, OFFSET_NS

ROOT = Path(__file__).parents[2]
LIGHT_MPS = 299_792_458.0
TRACK, GLONASS_ITEM = 1, 8

SCENARIO = f"""
name = "third"
[time]
start_gps = "2012-10-31T00:15:00"
duration_s = 120
[sky]
kepler = "{{kepler}}"
kepler_offset_ns = {OFFSET_NS}
{{sky}}
[[craft]]
name = "soyuz"
vehicle = "soyuz-ms.toml"
orbit = {{{{altitude_km = 415, inclination_deg = 51.6}}}}
clock = {{{{amplitude_ms = 1.0}}}}
[craft.factors]
code_noise = false
carrier_noise = false
doppler_noise = false
[craft.flight]
policy = "{{policy}}"
"""


def started(folder, policy="patent", sky="", *more, kepler="nominal"):
    """A run with the third system, ended."""
    scenario = folder / "third.toml"
    scenario.write_text(SCENARIO.format(policy=policy, sky=sky, kepler=kepler))
    return command("run", scenario, "--bus", "inline", "--quiet", "--out", folder / "run", *more)


def command(*arguments):
    """A command of the bench where the third system exists, ended."""
    return subprocess.run(
        [sys.executable, "-m", "tests.support.third_system", *map(str, arguments)],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip


def flown(folder, policy="patent", sky=""):
    """The folder of a run with the third system."""
    done = started(folder, policy, sky)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "run"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("third"))


def decoded(run, kind, number=0):
    """Values (n,) of all frames of a kind in the recording."""
    contract = codec(4)
    with (run / "bus.log").open("rb") as log:
        frames = concat([frames for _, _, frames, _ in read_chunks(log, "bus.log")])
    return contract.decode(kind, frames.data[frames.can_id == contract.can_id_of[kind, number]])


def errors_m(run):
    """Of the fixes' positions (e,), and their dilutions (e,)."""
    fixes, truth = pl.read_parquet(run / "fixes.parquet"), pl.read_parquet(run / "truth.parquet")
    both = fixes.filter(pl.col("valid")).join(truth, on="t_gps_s", suffix="_true")
    apart = [both[f"{axis}_ecef_m"] - both[f"{axis}_ecef_m_true"] for axis in "xyz"]
    return np.sqrt(sum(part.to_numpy() ** 2 for part in apart)), both["pdop"].to_numpy()


def assert_exact(run):
    """The bus resolves 0.1 mm of ranges, satellites and clocks; a fix is that times its dilution."""
    error_m, pdop = errors_m(run)
    assert len(error_m) > 50
    assert (error_m / pdop).max() < 5e-4


def test_the_fix_has_the_third_systems_own_offset_and_is_exact(run):
    """123 ns are 36.874 m; GLONASS's 30 ns stay its own. Noise-free: millimetres, as of two systems."""
    clock = decoded(run, "NAV_CLOCK")
    for item, offset_ns in ((KEPLER.time_offset_item, OFFSET_NS), (GLONASS_ITEM, 30.0)):
        offset_m = clock["bias_m"][clock["item"] == item]
        assert len(offset_m) > 60
        np.testing.assert_allclose(offset_m[-20:], offset_ns * 1e-9 * LIGHT_MPS, atol=0.002)
    assert_exact(run)
    assert errors_m(run)[0][-20:].max() < 0.001


def test_its_satellites_are_commanded_tracked_and_used(run):
    """Commands, measurements and the list of used channels name the system by its value and signal."""
    commands = [decoded(run, "COMMAND", r) for r in range(1, 5)]
    ours = [(c, (c["sat_system"] == KEPLER.value) & (c["action"] == TRACK)) for c in commands]
    assert len({int(number) for c, rows in ours for number in c["sat_number"][rows]}) >= 4
    assert {int(signal) for c, rows in ours for signal in c["signal"][rows]} == {K1.value}
    used = pl.read_parquet(run / "channels.parquet").filter(pl.col("used"))["satellite"].unique().to_list()
    assert {name[0] for name in used} == {"G", "R", KEPLER.letter}
    assert sum(name.startswith(KEPLER.letter) for name in used) >= 4


@pytest.mark.parametrize("policy", ["prototype", "single"])
def test_other_navigators_find_its_offset_too(tmp_path, policy):
    """The mean of receivers, and the best antenna, whose fixes are those of the antenna."""
    run = flown(tmp_path, policy)
    if policy == "prototype":
        assert_exact(run)
    clock = decoded(run, "NAV_CLOCK")
    offset_m = clock["bias_m"][clock["item"] == KEPLER.time_offset_item]
    np.testing.assert_allclose(offset_m[-20:], OFFSET_NS * 1e-9 * LIGHT_MPS, atol=0.005)


def test_it_is_navigated_by_alone(tmp_path):
    """Without the reference system a clock contains the offset: position as exact, no item of its own."""
    run = flown(tmp_path, sky='gps = "none"\nglonass = "none"')
    assert_exact(run)
    assert set(decoded(run, "NAV_CLOCK")["item"].tolist()) == {0}


def test_an_export_has_its_ranges_and_orbits_and_the_others_messages(run, tmp_path):
    """Without makers of its messages the navigation file is that of the others, and says so once."""
    done = command("export", "rinex", run, "--out", tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stderr.count("without") == 1
    assert "broadcast.nav is without kepler (no messages of it are made)" in done.stderr
    found = rinex_nav.parse((tmp_path / "broadcast.nav").read_text(), "written")
    assert {letter: len(set(rows.number.tolist())) for letter, rows in found.records.items()} == {
        "G": 24,
        "R": 24,
    }
    for name, start in (("soyuz.obs", KEPLER.letter), ("satellites.sp3", f"P{KEPLER.letter}")):
        assert len({line[:4] for line in (tmp_path / name).open() if line.startswith(start)}) >= 4


@pytest.mark.parametrize(
    ("factor", "where", "what"),
    [
        ("data_collection", "craft.soyuz.factors", "frames of messages"),
        ("transmit_pattern", "craft.soyuz.factors", "blocks"),
        ("ephemeris_error", "sky.factors.ephemeris_error", "errors"),
        ("satellite_clock_error", "sky.factors.satellite_clock_error", "errors"),
    ],
)
def test_a_model_without_a_row_of_it_is_refused_in_one_line(tmp_path, factor, where, what):
    done = started(tmp_path, "patent", "", "--on", factor)
    assert done.returncode == 2
    assert done.stderr.strip() == f"gnss-hil: {where}: no {what} of kepler are known"


def test_messages_without_a_layout_of_it_are_refused_in_one_line(tmp_path):
    (tmp_path / "kepler.rnx").write_text("made up\n")
    done = started(tmp_path, kepler="kepler.rnx")
    assert done.returncode == 2
    assert "sky.kepler: navigation messages of kepler are not read" in done.stderr
