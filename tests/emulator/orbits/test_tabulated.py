"""Orbits from tables: joined as far as they can be believed, told or refused where not."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime
from gnss_hil.emulator.earth import frames
from gnss_hil.emulator.earth.constants import MU_M3PS2
from gnss_hil.emulator.files.oem import Ephemeris
from gnss_hil.emulator.orbits import tabulated
from gnss_hil.emulator.orbits.tabulated import Wanted
from gnss_hil.emulator.orbits.trajectory import TrajectoryError, hermite

pytestmark = pytest.mark.verifies(
    "emulator/orbits/tabulated.py",
    what="What tables of states lack: gaps, coarse steps, other units, axes and centres",
    by="circular orbits in closed form",
    status="validated",
)

START_NS = gpstime.from_utc(datetime(2020, 1, 1))
RADIUS_M = 6.79e6
RATE_RPS = np.sqrt(MU_M3PS2 / RADIUS_M**3)


def circle(t_s, radius_m=RADIUS_M, speed=1.0, turn_rad=0.9):
    """A circle in celestial axes, inclined; its positions and velocities."""
    w = speed * np.sqrt(MU_M3PS2 / radius_m**3)
    angle = np.asarray(t_s)[:, None] * w
    u, v = np.array((1.0, 0, 0)), np.array((0, np.cos(turn_rad), np.sin(turn_rad)))
    place = radius_m * (np.cos(angle) * u + np.sin(angle) * v)
    return place, radius_m * w * (np.cos(angle) * v - np.sin(angle) * u)


def ns(t_s):
    return START_NS + np.rint(np.asarray(t_s) * 1e9).astype(np.int64)


def message(*stretches, frame="GCRF", useable=()):
    """An ephemeris of stretches (t_s, positions, velocities)."""
    t_s, place, rate = (np.concatenate(parts) for parts in zip(*stretches, strict=True))
    begins = np.cumsum([0, *(len(one[0]) for one in stretches[:-1])]).tolist()
    return Ephemeris("X", frame, ns(t_s), place, rate, tuple(begins), useable)


def stretch(begin_s, end_s, step_s, **more):
    t_s = np.arange(begin_s, end_s + 1, step_s, dtype=float)
    return t_s, *circle(t_s, **more)


def read(given, begin_s, end_s):
    """The orbit over a run, and what was told."""
    told = []
    span_ns = tuple(ns((begin_s, end_s)).tolist())
    return tabulated.of_ephemeris(given, Wanted("x.oem", None, span_ns, told.append)), told


def off_m(orbit, t_s, **more):
    """How far the orbit is from the circle at times t_s."""
    t_ns, (place, _) = ns(t_s), circle(t_s, **more)
    expected = np.einsum("nij,nj->ni", frames.ecef_from_gcrs(t_ns), place)
    return np.linalg.norm(orbit.over(t_ns).pos_ecef_m - expected, axis=1).max()


def test_a_fine_table_is_joined_without_a_word():
    orbit, told = read(message(stretch(0, 7200, 60)), 0, 7200)
    assert off_m(orbit, np.linspace(0, 7200, 77)) < 1e-3
    assert not told


def test_hermites_polynomial_is_exact_for_those_of_its_degree():
    t = np.sort(np.random.default_rng(4).uniform(0, 10, 24))
    at = np.linspace(t[0], t[-1], 57)
    values, slopes, expected = (np.stack((x**11 / 1e5 - x**3, 2 * x), 1) for x in (t, t, at))
    slopes = np.stack((11 * t**10 / 1e5 - 3 * t**2, np.full(24, 2.0)), 1)
    assert np.allclose(hermite(t, values, slopes, at, 6), expected, rtol=1e-8, atol=1e-4)
    assert np.allclose(hermite(t, values, slopes, t, 6), values, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("step_s", [600, 1200])
def test_velocities_help_where_positions_are_too_coarse(step_s):
    orbit, told = read(message(stretch(0, 30 * step_s, step_s)), 15 * step_s, 15 * step_s + 2000)
    assert off_m(orbit, 15 * step_s + np.linspace(0, 2000, 33)) < 0.5
    assert not told
    state = orbit.at(int(ns(16 * step_s)))
    turned = frames.ecef_from_gcrs(int(ns(16 * step_s)))
    rate = turned @ circle([16.0 * step_s])[1][0] - np.cross((0, 0, 7.292115e-5), state.pos_ecef_m)
    assert np.abs(state.vel_ecef_mps - rate).max() < 0.01


def test_without_velocities_a_coarse_step_is_told_with_what_it_makes_uncertain():
    t_s, place, _ = stretch(0, 30 * 600, 600)
    told = []
    orbit = tabulated.of_table(
        ns(t_s), place, "GCRF", Wanted("x.csv", None, tuple(ns((9010, 9500)).tolist()), told.append)
    )
    wrong_m = off_m(orbit, np.linspace(9010, 9500, 50))
    assert wrong_m > 1
    assert len(told) == 1
    assert "x.csv: at " in told[0]
    assert "states are 600 s apart, too coarse a step" in told[0]
    assert float(told[0].split("some ")[1].split()[0]) > wrong_m / 1000  # km, at least as much


@pytest.mark.parametrize("velocities", ["none", "zeros", "of other units"])
def test_a_table_that_is_no_orbit_between_its_states_is_refused(velocities):
    t_s, place, rate = stretch(0, 30 * 2400, 2400)
    rate = {"none": rate * np.nan, "zeros": 0 * rate, "of other units": 1e3 * rate}[velocities]
    rate = np.nan_to_num(rate)
    with pytest.raises(TrajectoryError, match=r"x\.oem: at .* states are 2400 s apart, too coarse a step"):
        read(message((t_s, place, rate)), 30_100, 30_200)


def test_a_hole_in_a_table_is_told_where_a_run_needs_it_only():
    t_s, place, rate = stretch(0, 14_400, 60)
    kept = (t_s < 6000) | (t_s > 8400)
    given = message((t_s[kept], place[kept], 0 * rate[kept]))
    _, told = read(given, 600, 1200)
    assert not told
    orbit, told = read(given, 7000, 7200)
    wrong_m = off_m(orbit, np.linspace(7000, 7200, 9))
    assert 100 < wrong_m < 3000
    assert told == [
        "x.oem: at 2020-01-01T02:00:18 GPS states are 2520 s apart, too coarse a step or not of one orbit: "
        "the place is uncertain by some 3.38 km"
    ]
    kept = (t_s < 3000) | (t_s > 9600)
    given = message((t_s[kept], place[kept], rate[kept]))
    with pytest.raises(TrajectoryError, match=r"states are 6720 s apart, too coarse a step"):
        read(given, 6200, 6400)


def test_a_run_between_two_segments_is_refused():
    given = message(stretch(0, 1200, 60), stretch(7200, 8400, 60))
    for begin, end in ((100, 1100), (7200, 8400)):
        orbit, told = read(given, begin, end)
        assert off_m(orbit, np.linspace(begin, end, 21)) < 1e-3
        assert not told
    for begin, end in ((3600, 3700), (1100, 1300), (7100, 7300), (600, 7300)):
        with pytest.raises(
            TrajectoryError, match=r"no state between .*00:20:18 and .*02:00:18, where one seg"
        ):
            read(given, begin, end)


def test_a_reference_may_have_gaps_and_knows_where():
    given, told = message(stretch(0, 1200, 60), stretch(7200, 8400, 60)), []
    span_ns = tuple(ns((600, 7800)).tolist())
    orbit = tabulated.of_ephemeris(given, Wanted("x.oem", None, span_ns, told.append, whole=False))
    assert told == [
        "x.oem: no state between 2020-01-01T00:20:18 and 2020-01-01T02:00:18, where one segment ends and the "
        "next begins: nothing is known there"
    ]
    assert [orbit.holds(int(t)) for t in ns((-1, 0, 1200, 1201, 7199, 7200, 8400, 8401))] == [
        False, True, True, False, False, True, True, False,
    ]  # fmt: skip
    assert off_m(orbit, np.linspace(7200, 7800, 9)) < 1e-3
    for begin_s, end_s in ((600, 9000), (-500, 9000)):
        span_ns = tuple(ns((begin_s, end_s)).tolist())
        part = tabulated.of_ephemeris(given, Wanted("x.oem", None, span_ns, told.append, whole=False))
        assert off_m(part, np.linspace(7200, 8400, 9)) < 1e-3
    for begin_s, end_s in ((8401, 9000), (-50, -1)):
        with pytest.raises(TrajectoryError, match="states from"):
            outside_ns = tuple(ns((begin_s, end_s)).tolist())
            tabulated.of_ephemeris(given, Wanted("x.oem", None, outside_ns, told.append, whole=False))


def test_segments_that_meet_are_kept_apart_and_the_later_one_counts_from_there():
    """A burn: the same place and instant, another velocity."""
    first = stretch(0, 1200, 60)
    t_s = np.arange(1200.0, 2401.0, 60)
    place, rate = circle([1200.0])
    after_place, after_rate = fallen(place[0], rate[0] * 1.01, t_s - 1200)
    orbit, told = read(message(first, (t_s, after_place, after_rate)), 0, 2400)
    assert not told
    assert off_m(orbit, np.linspace(0, 1199.9, 33)) < 1e-3
    before, after = (orbit.at(int(ns(t))).vel_ecef_mps for t in (1200 - 1e-6, 1200))
    assert np.linalg.norm(after - before) == pytest.approx(0.01 * RADIUS_M * RATE_RPS, rel=1e-3)
    at_ns = ns(np.array((1170.0, 1200.0, 1230.0)))
    together = orbit.over(at_ns)
    for row, t_ns in enumerate(at_ns.tolist()):
        assert np.array_equal(together.vel_ecef_mps[row], orbit.at(t_ns).vel_ecef_mps)


def fallen(place, rate, t_s):
    """States of a free fall about a ball, by small steps."""
    from scipy.integrate import solve_ivp

    def pull(t, y):
        return np.concatenate((y[3:], -MU_M3PS2 * y[:3] / np.linalg.norm(y[:3]) ** 3))

    found = solve_ivp(pull, (0, t_s[-1]), np.concatenate((place, rate)), t_eval=t_s, rtol=1e-11, atol=1e-4)
    return found.y[:3].T, found.y[3:].T


def test_of_overlapping_segments_what_is_for_use_counts():
    """States beyond are there to interpolate with: of another speed here, so that they show."""
    one, other = stretch(0, 2400, 60), stretch(1200, 3600, 60, turn_rad=1.0)
    useable = tuple(tuple(ns(span).tolist()) for span in ((0, 1800), (1800, 3600)))
    orbit, told = read(message(one, other, useable=useable), 0, 3600)
    assert off_m(orbit, np.linspace(0, 1799, 21)) < 1e-3
    assert off_m(orbit, np.linspace(1800, 3600, 21), turn_rad=1.0) < 1e-3
    assert not told


def test_segments_that_overlap_with_other_orbits_are_told_where_a_run_is_there():
    one, other = stretch(0, 2400, 60), stretch(1200, 3600, 60, turn_rad=1.0)
    orbit, told = read(message(one, other), 0, 3600)
    assert off_m(orbit, np.linspace(1200, 3600, 21), turn_rad=1.0) < 1e-3
    (line,) = told
    assert line.startswith(
        "x.oem: segments overlap from 2020-01-01T00:20:18 to 2020-01-01T00:40:18 GPS and are up"
    )
    assert line.endswith(" km apart: the later one counts")
    assert not read(message(one, other), 0, 1100)[1]
    assert not read(message(stretch(0, 2400, 60), stretch(1200, 3600, 60)), 0, 3600)[1]


@pytest.mark.parametrize(("scale", "km"), [(1000.0, "6790000"), (1e-3, "6.79"), (0.27, "1833.3")])
def test_states_of_other_units_or_about_another_body_are_refused(scale, km):
    t_s, place, rate = stretch(0, 1200, 60)
    with pytest.raises(TrajectoryError, match=rf"is {km} km from the Earth's centre: are units and centre"):
        read(message((t_s, scale * place, scale * rate)), 0, 1200)


def in_feet(given):
    t_s, place, rate = given
    return message((t_s, place / 0.3048, rate / 0.3048))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (message(stretch(0, 3600, 60), frame="ITRF2014"), "axes"),
        (message(stretch(0, 3600, 60, speed=1.2)), "times"),
        (message(stretch(0, 3600, 60, speed=0.11, radius_m=2e7)), "centre"),
    ],
    ids=["turning axes", "other seconds", "about the Moon"],
)  # fmt: skip
def test_a_motion_that_gravity_does_not_explain_is_told(given, words):
    told = read(given, 600, 3000)[1]
    assert any("differs from a free fall about the Earth" in line and words in line for line in told)


def test_feet_taken_for_metres_are_refused():
    with pytest.raises(
        TrajectoryError, match=r"differs from a free fall about the Earth by up to 3.\d\d% of gr"
    ):
        read(in_feet(stretch(0, 3600, 60)), 600, 3000)


def test_high_and_eccentric_orbits_fall_freely():
    for radius_m in (6.6e6, 2.66e7, 4.2e7, 9e7, 3.8e8):
        told = read(message(stretch(0, 9000, 60, radius_m=radius_m)), 600, 8000)[1]
        assert not told
    t_s = np.arange(0, 40_000, 120.0)
    place, rate = fallen(np.array((6.8e6, 0, 0)), np.array((0, 7000.0, 7500.0)), t_s)
    assert not read(message((t_s, place, rate)), 0, 39_000)[1]


def test_velocities_that_are_not_those_of_the_positions_are_told():
    t_s, place, rate = stretch(0, 3600, 60)
    told = read(message((t_s, place, rate + np.array((0, 0, 20.0)))), 600, 3000)[1]
    assert len(told) == 1
    assert "the velocity written is 20 m/s off that of the positions, which are flown" in told[0]
    assert not read(message((t_s, place, np.round(rate))), 600, 3000)[1]
    assert not read(message((t_s, place, 0 * rate)), 600, 3000)[1]


@pytest.mark.parametrize("absent", [0.0, 999_999_999.999])
def test_the_same_number_three_times_is_no_state(absent):
    t_s, place, rate = stretch(0, 3600, 60)
    place[30] = absent
    orbit, told = read(message((t_s, place, rate)), 0, 3600)
    assert off_m(orbit, np.linspace(0, 3600, 41)) < 0.1
    assert told == ["x.oem: 1 states are left out: the same number three times is none"]
    place[1:] = absent
    with pytest.raises(TrajectoryError, match=r"x\.oem: fewer than two states"):
        read(message((t_s, place, rate)), 0, 3600)


def test_of_a_long_table_what_a_run_needs_is_read():
    """And nothing else: a state of another unit a day away does not matter, one within the run does."""
    t_s, place, rate = stretch(0, 40_000, 10)
    place[3000] *= 1000
    orbit, told = read(message((t_s, place, rate)), 1000, 2000)
    assert not told
    assert off_m(orbit, np.linspace(900, 2100, 77)) < 1e-3
    assert len(orbit.arcs[0].t_ns) < 200
    with pytest.raises(TrajectoryError, match="are units and centre right"):
        read(message((t_s, place, rate)), 29_900, 30_100)
    for span in ((0, 10), (39_990, 40_000), (0, 40_000)):
        whole = read(message(stretch(0, 40_000, 10)), *span)[0]
        assert off_m(whole, np.linspace(*span, 9)) < 1e-3
