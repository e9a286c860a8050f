"""The scenario of two carriers from end to end: pairs on the nearest antenna, fixes without ionosphere."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import polars
import pytest

from gnss_hil.tools.command_line.main import main
from tests.support.receiver_py import PROGRAM, VEHICLE
from tests.support.runs import summary_of

pytestmark = pytest.mark.verifies(
    "flightsw/assignment/pairs.py",
    "flightsw/measurement/ionosphere_free.py",
    what="Fixes from pairs of signals of emulated receivers",
    by=(
        "the truth: without noise 3 mm where one carrier is metres off; every satellite by both signals on "
        "one antenna"
    ),
    status="validated",
)

NOISE = ("code_noise", "carrier_noise", "doppler_noise")
SECOND = {"L1CA": "L2C", "L1OF": "L2OF"}


def played(folder: Path, *more: str) -> dict:
    """Without noise, each epoch's pairs by themselves."""
    quiet = [word for name in NOISE for word in ("--off", name)]
    return noisy(folder, *quiet, "--option", "ionosphere_walk_mps_rts=0", *more)


def noisy(folder: Path, *more: str) -> dict:
    command = ["run", "soyuz-l1l2", "--bus", "inline", "--duration", "150", "--out", str(folder), "--quiet"]
    assert main([*command, *more]) == 0
    return summary_of(folder)["craft"]["soyuz"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("carriers") / "run"


@pytest.fixture(scope="module")
def summary(folder):
    return played(folder)


def test_without_noise_pairs_put_the_craft_where_it_is(summary):
    assert summary["position_error_m"]["max"] < 3e-3
    assert summary["velocity_error_mps"]["max"] < 2e-3
    assert summary["satellites_tracked"]["max"] >= 18
    assert summary["measurements"]["max"] == 2 * summary["satellites_tracked"]["max"]
    assert summary["satellites_paired"] == summary["satellites_tracked"]


def test_delays_that_are_followed_take_most_of_the_noise_away(tmp_path):
    """As shipped; against the pairs of each epoch by themselves, 150 epochs of one seed."""
    followed = noisy(tmp_path / "followed")
    alone = noisy(tmp_path / "alone", "--option", "ionosphere_walk_mps_rts=0")
    assert followed["fixes"] == alone["fixes"]
    for figure in ("position_error_m", "velocity_error_mps"):
        assert followed[figure]["median"] < 0.7 * alone[figure]["median"]


def test_the_same_sky_by_one_signal_is_off(tmp_path):
    off = played(tmp_path / "one", "--option", "ionosphere_free=false", "--option", "inconsistent=fix")
    assert off["position_error_m"]["median"] > 0.5


def test_every_satellite_is_on_one_antenna_by_both_signals(folder, summary):
    table = polars.read_parquet(folder / "channels.parquet")
    late = table.filter(polars.col("t_gps_s") == table["t_gps_s"].max())
    late = late.filter(polars.col("used"))
    by_satellite = late.group_by("satellite").agg("receiver", "signal")
    assert len(by_satellite) >= 16
    for _, receiver, signal in by_satellite.iter_rows():
        assert len(set(receiver)) == 1 and len(signal) == 2
        first = next(name for name in signal if name in SECOND)
        assert set(signal) == {first, SECOND[first]}


def test_satellites_that_lack_the_second_signal_are_refused_once(summary):
    """Of 24 nominal numbers seven were of blocks without L2C on that day: what rises is asked for it."""
    assert 1 <= summary["assignment"]["rejected"] <= 7


def test_a_vehicle_of_one_carrier_navigates_by_one(tmp_path):
    found = played(tmp_path / "single", "--vehicle", "soyuz-ms", "--option", "inconsistent=fix")
    assert found["fixes"] > 60 and found["measurements"]["max"] <= 24
    assert found["satellites_paired"]["max"] == 0
    assert found["position_error_m"]["median"] > 0.5, "the ionosphere is in, as far as it is not modelled"


@pytest.mark.parametrize("policy", ["prototype", "analogue", "single"])
def test_receivers_left_alone_make_pairs_too(tmp_path, policy):
    found = played(tmp_path / policy, "--policy", policy, "--ionosphere-free")
    assert found["fixes"] > 100 and found["measurements"]["min"] >= 2 * found["satellites_tracked"]["min"]
    # Without lever arms the place is that of the antennas, 2.6 m from the centre of mass at most.
    assert found["position_error_m"]["max"] < (3e-3 if policy == "prototype" else 3.0)


def test_a_receiver_that_has_no_second_signal_is_flown_by_its_first_and_that_is_said(tmp_path, capsys):
    """The receiver in Python, whose vehicle file is told two carriers: it refuses the second of every one."""
    text = VEHICLE.read_text().replace("clock_domain", 'other_signals = ["L2C", "L2OF"]\nclock_domain')
    (tmp_path / "two.toml").write_text(text)
    program = shlex.join([sys.executable, str(PROGRAM), str(tmp_path / "truth.csv")])
    command = [
        "run",
        "soyuz",
        "--vehicle",
        str(tmp_path / "two.toml"),
        "--duration",
        "40",
        "--ionosphere-free",
    ]
    assert main([*command, "--emulator", program, "--out", str(tmp_path / "run"), "--quiet"]) == 0
    found = summary_of(tmp_path / "run")["craft"]["soyuz"]
    assert found["fixes"] == 40 and found["satellites_paired"]["max"] == 0
    assert found["assignment"]["rejected"] >= 4
    assert "craft soyuz: 40 of 40 fixes by one carrier: too few pairs" in capsys.readouterr().err
