"""What a sky lacks in a run is told, and nothing is told of one that lacks nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import satellites
from gnss_hil.emulator.constellation import precise, presence
from tests.emulator.constellation.test_precise import START_NS, product, thinned

pytestmark = pytest.mark.verifies(
    "emulator/constellation/presence.py",
    what="What a sky lacks in a run",
    by="made-up products",
    status="modelled",
)

INDEX = satellites.index(satellites.GPS, np.array([1, 5, 9]))
MINUTES = presence.minutes_ns(START_NS, START_NS + 599 * 10**9)
NAMES = ("G05", "R11")


def told(there):
    return list(presence.remarks(INDEX, np.asarray(there, bool), MINUTES))


def test_minutes_are_all_of_a_run_or_many():
    assert len(MINUTES) == 10
    assert MINUTES[0] == START_NS + 30 * 10**9
    assert len(presence.minutes_ns(START_NS, START_NS)) == 1
    month = presence.minutes_ns(START_NS, START_NS + 31 * 86_400 * 10**9)
    assert len(month) == 300
    assert month[-1] - month[0] == 31 * 86_400 * 10**9


def test_nothing_is_told_of_a_sky_that_is_there():
    assert not told(np.ones((10, 3)))
    few_holes = np.ones((10, 3))
    few_holes[4, 1] = 0
    assert not told(few_holes)


def test_what_is_missing_is_told():
    assert told(np.zeros((10, 3))) == ["no satellite is known in the run"]
    empty = np.ones((10, 3))
    empty[[3, 4, 8]] = 0
    assert told(empty) == [
        "no satellite is known in 30% of the run, from 2023-03-23T00:03:00 to 2023-03-23T00:05:00 GPS at "
        "first"
    ]
    partly = np.ones((10, 3))
    partly[:2, 0], partly[:, 2] = 0, 0
    assert told(partly) == [
        "nothing is known in the run of G09", "known in a part of the run only: G01",
    ]  # fmt: skip


def test_a_sky_of_which_all_is_unhealthy_is_told():
    there, healthy = np.ones((10, 3), bool), np.zeros((10, 3), bool)
    said = "all satellites known are marked unhealthy by their messages: receivers use none"
    assert list(presence.remarks(INDEX, there, MINUTES, healthy)) == [f"in the run {said}"]
    healthy[3:, 1] = True
    assert list(presence.remarks(INDEX, there, MINUTES, healthy)) == [f"in 30% of the run {said}"]
    healthy[:, 2] = True
    assert not list(presence.remarks(INDEX, there, MINUTES, healthy))


def of_product(made, system=None, offset_m=None, begin_s=36_000, end_s=39_000):
    orbits = precise.layered(made, offset_m)
    span = START_NS + begin_s * 10**9, START_NS + end_s * 10**9
    return list(presence.of_product(made, orbits, *span, system))


def test_nothing_is_told_of_a_product_that_is_whole():
    assert not of_product(product())
    assert not of_product(replace(product(), frame="IGS20, ITRF2", predicted=np.zeros(97, bool)))


def test_satellites_without_a_clock_in_the_run_or_without_an_antenna_are_told():
    made = product()
    made.clock_s[30:60, 1] = np.nan
    assert of_product(made) == ["no clock in the run's time of R11: left out"]
    assert not of_product(made, satellites.GPS)
    assert not of_product(made, begin_s=3600, end_s=7200)
    made.clock_s[30:60, 1] = 0
    assert of_product(made) == ["clocks are exactly 0 of R11: are they absent?"]
    offset_m = np.zeros((satellites.SATELLITES, 3))
    offset_m[satellites.parse("G05")] = np.nan
    assert of_product(product(), None, offset_m) == ["no antenna is known of G05: left out"]


def test_other_axes_predictions_coarse_steps_and_strange_motions_are_told():
    assert of_product(replace(product(), frame="XYZ")) == [
        "coordinate system is 'XYZ'; taken for one of the ITRF"
    ]
    predicted = replace(product(), predicted=np.arange(97) >= 42)
    assert of_product(predicted) == ["orbits are predicted, not measured, from 2023-03-23T10:30:00 on"]
    assert not of_product(predicted, begin_s=3600, end_s=7200)
    (coarse,) = of_product(thinned(product(193), 3600), begin_s=66_000, end_s=69_000)
    assert coarse.startswith("instants are too coarse a step apart: the place of ")
    still = product()
    angle = 7.2921151467e-5 * (still.t_ns - START_NS) / 1e9
    cos, sin, zero = np.cos(angle), np.sin(angle), np.zeros(97)
    back = np.array(((cos, -sin, zero), (sin, cos, zero), (zero, zero, zero + 1)))
    inertial = replace(still, pos_ecef_m=np.einsum("ijt,tnj->tni", back, still.pos_ecef_m))
    (strange,) = of_product(inertial)
    assert strange.startswith(
        "G05 and R11: motion is not a fall about the Earth: are coordinate system, units"
    )


def test_manoeuvres_and_jumps_of_clocks_near_the_run_are_told():
    breaks = tuple((START_NS + hour * 3600 * 10**9, "R11", "a manoeuvre") for hour in (5, 11))
    assert of_product(replace(product(), breaks=breaks)) == [
        "R11 has a manoeuvre before 2023-03-23T11:00:00: nothing is interpolated across it"
    ]
    assert not of_product(replace(product(), breaks=breaks), satellites.GPS)


def test_files_that_disagree_are_told():
    assert not of_product(replace(product(), apart_m=0.5))
    assert of_product(replace(product(), apart_m=123.4)) == [
        "files disagree by up to 123 m where several have a place: the last one counts"
    ]
