"""A flight software judged by tests: `pytest examples/bench_tests`.

Needs `pip install "gnss-hil[bench]"`. Each test plays its own runs; `bench` comes with the package. To judge
your own flight software, put its command into FLIGHT: it finds its bus, vehicle file and craft in
GNSS_HIL_BUS, GNSS_HIL_VEHICLE and GNSS_HIL_CRAFT.
"""

from __future__ import annotations

import polars as pl
import pytest

import gnss_hil

FLIGHT = None
"""["./my-fsw", "--arg"]; None: the one that ships."""


def test_fixes_are_good_and_there(bench: gnss_hil.Bench):
    run = bench.run("soyuz", duration="3m", flight=FLIGHT)
    assert run.availability == 1.0
    assert run.fix_error_m.max() < 5
    assert run.rejected.is_empty()


def test_a_receiver_that_is_off_is_noticed_and_missed_by_nobody(bench: gnss_hil.Bench):
    run = bench.run("soyuz", duration="4m", faults=["rx2 off @2m+30s"], flight=FLIGHT)
    assert run.detected("silence", within=2, where="RX2")
    assert run.availability > 0.99
    assert run.fix_error_m.max() < 5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_first_fix_comes_within_a_minute(bench: gnss_hil.Bench, seed: int):
    run = bench.run("soyuz", duration=60, seed=seed, flight=FLIGHT)
    assert run.errors["t_s"].min() <= 60


def test_another_orbit_has_other_satellites(bench: gnss_hil.Bench):
    low = bench.run("soyuz", duration=60, flight=FLIGHT, set={"craft.0.orbit.altitude_km": 250})
    high = bench.run("soyuz", duration=60, flight=FLIGHT, set={"craft.0.orbit.altitude_km": 600})
    assert not low.truth.equals(high.truth)
    measured = [run.channels.filter(pl.col("used"))["satellite"].n_unique() for run in (low, high)]
    assert min(measured) >= 4


def test_a_mistake_is_told_before_anything_starts(bench: gnss_hil.Bench):
    with pytest.raises(gnss_hil.BenchError, match="did you mean 'soyuz'"):
        bench.run("soyus", duration=60)
