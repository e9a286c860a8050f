"""Is the covariance that the flight software publishes true? Errors against the emulator's truth, which draws
by models of its own, over whole runs of several seeds: mean squares by the covariance, 3 for three axes.

What a run draws once (orbits and clocks of satellites, delays of receivers) makes its errors one draw, so
that runs differ; the bounds are for the mean of the runs.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

from gnss_hil.tools.command_line.main import main

pytestmark = [
    pytest.mark.slow(seconds=20),
    pytest.mark.verifies(
        "flightsw/measurement/budget.py",
        "flightsw/measurement/noise.py",
        "flightsw/estimation/receiver_delays.py",
        "flightsw/estimation/unreduced.py",
        what="The covariance that is published",
        by=(
            "mean squared errors by it, of emulated runs (noise alone, every factor, station, geostationary, "
            "antennas that are not reduced)"
        ),
        status="validated",
    ),
]

GEOSTATIONARY = """
name = "high"
[time]
start_gps = "2012-10-31T00:15:00"
duration_s = 43200
epoch_interval_s = 60.0
[sky]
gps = "nominal"
glonass = "nominal"
[sky.factors]
ephemeris_error = true
satellite_clock_error = true
[[craft]]
name = "craft"
vehicle = "craft.toml"
orbit = {altitude_km = 35786, inclination_deg = 0.1}
attitude = {mode = "lvlh"}
[craft.receivers]
lock_threshold_dbhz = 20
gain_dbi = 10
[craft.factors]
transmit_pattern = true
"""
NADIR = """
name = "nadir"
[[antenna]]
name = "nadir"
receiver = 1
channels = 16
boresight_body = [0.0, 0.0, 1.0]
lever_arm_body_m = [0.0, 0.0, 1.0]
mask_deg = 45.0
"""


def flown(folder, scenario, *words, seeds=4, duration="60m", interval="10"):
    """Figures after convergence of the only craft, of each seed."""
    out = []
    for seed in range(1, seeds + 1):
        run = folder / f"run{seed}"
        command = ["run", str(scenario), "--bus", "inline", "--quiet", "--no-report", "--no-log"]
        command += ["--duration", duration, "--interval", interval, "--seed", str(seed), "--out", str(run)]
        assert main([*command, *words]) == 0
        (craft,) = json.loads((run / "summary.json").read_text())["craft"].values()
        out.append(craft["converged"])
    return out


def mean(runs, *path):
    values = []
    for figures in runs:
        for name in path:
            figures = figures[name]
        values.append(figures)
    return float(np.mean(values))


def test_noise_alone(tmp_path):
    runs = flown(tmp_path, "soyuz")
    assert 2.2 < mean(runs, "nees", "position") < 3.6
    assert 2.5 < mean(runs, "nees", "velocity") < 3.6
    assert mean(runs, "position_error_m", "median") < 0.6


def test_every_factor(tmp_path):
    runs = flown(tmp_path, "soyuz", "--on", "all", seeds=6)
    assert 1.5 < mean(runs, "nees", "position") < 3.6
    assert 2.5 < mean(runs, "nees", "velocity") < 3.6
    assert 0.2 < mean(runs, "nees", "clock") < 2
    assert mean(runs, "position_error_m", "median") < 3.0
    assert all(figures["fixes"] > 0.99 * figures["epochs"] for figures in runs)


def test_the_station_amid_its_structure(tmp_path):
    runs = flown(tmp_path, "iss", duration="93m")
    assert 2.2 < mean(runs, "nees", "position") < 3.8
    assert 2.3 < mean(runs, "nees", "velocity") < 3.6


@pytest.mark.parametrize("policy", ["single", "analogue"])
@pytest.mark.parametrize("scenario", ["soyuz", "iss-zenith"])
def test_antennas_that_are_not_reduced_to_the_centre_of_mass(tmp_path, scenario, policy):
    """The lever arm, many times what ranges err by, is in the covariance: without it 7 to 80."""
    runs = flown(tmp_path, scenario, "--policy", policy, seeds=2)
    assert 2.2 < mean(runs, "nees", "position") < 3.6
    assert 2.2 < mean(runs, "nees", "velocity") < 3.6
    assert mean(runs, "position_error_m", "median") > 2


def test_geostationary(tmp_path):
    (tmp_path / "geo.toml").write_text(GEOSTATIONARY)
    (tmp_path / "craft.toml").write_text(NADIR)
    runs = flown(tmp_path, tmp_path / "geo.toml", seeds=2, duration="12h", interval="60")
    assert 2.2 < mean(runs, "nees", "position") < 3.8
    assert 2.5 < mean(runs, "nees", "velocity") < 3.6
    assert 0.5 < mean(runs, "nees", "clock") < 1.6


@pytest.mark.parametrize("altitude_km", [7_000, 12_000])
def test_rays_that_graze_the_ionosphere(tmp_path, altitude_km):
    """All that an antenna towards the Earth tracks is beyond it: 4.7 without what rays scan of the layer."""
    (tmp_path / "high.toml").write_text(GEOSTATIONARY)
    (tmp_path / "craft.toml").write_text(NADIR)
    orbit = {"altitude_km": altitude_km, "inclination_deg": 51.6}
    words = [word for key, value in orbit.items() for word in ("--set", f"craft.0.orbit.{key}={value}")]
    runs = flown(
        tmp_path, tmp_path / "high.toml", *words, "--on", "ionosphere", seeds=3, duration="8h", interval="60"
    )
    assert 2.2 < mean(runs, "nees", "position") < 3.8
    assert 2.3 < mean(runs, "nees", "velocity") < 3.4
