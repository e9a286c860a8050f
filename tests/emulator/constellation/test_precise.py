"""Interpolation of precise orbits against orbits that are known everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from gnss_hil.dbc.common import gpstime, satellites
from gnss_hil.emulator.constellation import precise
from gnss_hil.emulator.files import sp3
from gnss_hil.emulator.files.sp3 import Sp3

MU, C, EARTH_RPS = 3.986004418e14, 299_792_458.0, 7.2921151467e-5
START_NS = gpstime.from_week(2254, 345_600)
STEP_S = 900
RADIUS_M, ECC, INCLINATION = 26_560e3, 0.02, np.radians(55)
RATE = np.sqrt(MU / RADIUS_M**3)


def kepler(t_s, lead_rad=0.0):
    """ECEF places (t, 3) of a two-body orbit and r . v (t,), by elements; t_s from START_NS (t,)."""
    mean = RATE * t_s + lead_rad
    anomaly = mean
    for _ in range(50):
        anomaly = mean + ECC * np.sin(anomaly)
    x, y = RADIUS_M * (np.cos(anomaly) - ECC), RADIUS_M * np.sqrt(1 - ECC**2) * np.sin(anomaly)
    inertial = np.stack((x, y * np.cos(INCLINATION), y * np.sin(INCLINATION)), axis=1)
    angle = EARTH_RPS * t_s
    cos, sin = np.cos(angle), np.sin(angle)
    ecef = np.stack(
        (
            cos * inertial[:, 0] + sin * inertial[:, 1],
            cos * inertial[:, 1] - sin * inertial[:, 0],
            inertial[:, 2],
        ),
        axis=1,
    )
    # Vis-viva in terms of the eccentric anomaly: r . v = sqrt(mu a) e sin E.
    return ecef, np.sqrt(MU * RADIUS_M) * ECC * np.sin(anomaly)


def product(instants=97, names=("G05", "R11"), clock=lambda t_s: 1e-4 + 1e-11 * t_s):
    t_s = STEP_S * np.arange(instants)
    pos = np.stack([kepler(t_s, 0.7 * k)[0] for k in range(len(names))], axis=1)
    clocks = np.repeat(clock(t_s)[:, None], len(names), axis=1)
    return Sp3("x", START_NS + t_s * gpstime.NS_PER_S, names, pos, clocks)


def middles(*t_s):
    return START_NS + np.rint(np.array(t_s) * 1e9).astype(np.int64)


def test_positions_and_relativity_between_the_instants():
    orbits = precise.from_sp3(product())
    t_s, nodes_s = np.linspace(5000, 80000, 301), np.array((-31.0, 0.0, 31.0))
    pos, clock, there = orbits.sample(middles(*t_s), nodes_s)
    assert there.all()
    assert orbits.index.tolist() == [satellites.parse("G05"), satellites.parse("R11")]
    for k, node_s in enumerate(nodes_s):
        for column in range(2):
            true, r_dot_v = kepler(t_s + node_s, 0.7 * column)
            assert np.linalg.norm(pos[:, k, column] - true, axis=1).max() < 1e-3
            clock_m = C * (1e-4 + 1e-11 * (t_s + node_s)) - 2 * r_dot_v / C
            assert clock[:, k, column] == pytest.approx(clock_m, abs=1e-5)
    assert np.ptp(clock[:, 1, 0]) > 10  # the relativity is metres: it was there to be found


def test_the_last_interval_is_worse_by_decimetres_at_most():
    t_s = np.concatenate((np.linspace(30, 870, 29), 96 * STEP_S - np.linspace(30, 870, 29)))
    pos, _, there = precise.from_sp3(product()).sample(middles(*t_s), np.zeros(1))
    assert there.all()
    assert np.linalg.norm(pos[:, 0, 0] - kepler(t_s)[0], axis=1).max() < 0.1


def test_what_polynomials_of_lagrange_are():
    """Weights are what NumPy's own polynomial through unit values says."""
    x = np.linspace(-1.02, 1.02, 41)
    value, slope = precise.weights(x, 10)
    nodes = np.linspace(-1, 1, 10)
    for k in range(10):
        others = np.delete(nodes, k)
        polynomial = np.polynomial.Polynomial.fromroots(others) / np.prod(nodes[k] - others)
        assert value[:, k] == pytest.approx(polynomial(x), abs=1e-9)
        assert slope[:, k] == pytest.approx(polynomial.deriv()(x), abs=1e-7)


def gap(rows, column, of="pos_ecef_m"):
    made = product()
    getattr(made, of)[rows, column] = np.nan
    return precise.from_sp3(made)


def test_nothing_is_interpolated_across_a_gap():
    """A satellite that is missing at one instant is gone on both sides of it, and only it."""
    orbits = gap(40, 0)
    t_s = STEP_S * np.array((38.5, 39.5, 40.5, 41.5))
    pos, clock, there = orbits.sample(middles(*t_s), np.zeros(1))
    assert there[:, 0].tolist() == [True, False, False, True]
    assert there[:, 1].all()
    assert np.isfinite(pos).all() and np.isfinite(clock).all()
    near = np.linalg.norm(pos[:, 0, 0] - kepler(t_s)[0], axis=1)[there[:, 0]]
    assert near.max() < 0.1


def test_an_arc_too_short_for_a_polynomial_is_left_out():
    orbits = gap([20, 20 + precise.POINTS], 0)  # leaves POINTS - 1 instants between
    _, _, there = orbits.sample(middles(STEP_S * 24.5), np.zeros(1))
    assert there.tolist() == [[False, True]]
    orbits = gap([20, 21 + precise.POINTS], 0)
    _, _, there = orbits.sample(middles(STEP_S * 24.5), np.zeros(1))
    assert there.tolist() == [[True, True]]


def test_a_missing_clock_is_a_missing_satellite():
    orbits = gap(40, 1, "clock_s")
    _, clock, there = orbits.sample(middles(STEP_S * 39.5, STEP_S * 41.5), np.zeros(1))
    assert there.tolist() == [[True, False], [True, True]]
    assert np.isfinite(clock).all()


def test_instants_missing_from_a_product_are_a_gap_for_all():
    made = product()
    keep = np.arange(97) != 50
    thinned = Sp3("x", made.t_ns[keep], made.name, made.pos_ecef_m[keep], made.clock_s[keep])
    _, _, there = precise.from_sp3(thinned).sample(
        middles(*(STEP_S * np.array((48.5, 49.5, 51.5)))), np.zeros(1)
    )
    assert there.tolist() == [[True, True], [False, False], [True, True]]


def test_nobody_is_there_outside_the_product():
    orbits = precise.from_sp3(product())
    first_ns, last_ns = orbits.span_ns
    assert (first_ns, last_ns) == (START_NS, START_NS + 86_400 * gpstime.NS_PER_S)
    _, _, there = orbits.sample(np.array((first_ns - 1, first_ns, last_ns, last_ns + 1)), np.zeros(1))
    assert there.all(axis=1).tolist() == [False, True, True, False]


def test_a_segment_that_the_product_only_touches_counts():
    """The last instant is in a segment whose middle lies behind it."""
    orbits, nodes_s = precise.from_sp3(product()), np.array((-30.0, 0.0, 30.0))
    ends_ns = np.array(orbits.span_ns)
    pos, _, there = orbits.sample(ends_ns + 30 * gpstime.NS_PER_S * np.array((-1, 1)), nodes_s)
    assert there.all()
    assert np.abs(pos[1, 0, 0] - kepler(np.array([86_400.0]))[0]).max() < 1.0
    _, _, there = orbits.sample(ends_ns + 31 * gpstime.NS_PER_S * np.array((-1, 1)), nodes_s)
    assert not there.any()


def test_satellites_without_a_phase_centre_are_left_out():
    offset_m = np.full((satellites.SATELLITES, 3), np.nan)
    offset_m[satellites.parse("R11")] = 0, 0, 2.3
    orbits = precise.from_sp3(product(), offset_m)
    assert orbits.index.tolist() == [satellites.parse("R11")]
    pos, _, _ = orbits.sample(middles(40_000), np.zeros(1))
    true, _ = kepler(np.array((40_000.0,)), 0.7)
    assert np.linalg.norm(true) - np.linalg.norm(pos) == pytest.approx(2.3, abs=1e-3)


@pytest.mark.parametrize("instants", [1, precise.POINTS - 1])
def test_too_few_instants_are_refused_in_words(instants):
    with pytest.raises(
        ValueError, match=f"x: {instants} instants? of 2 satellites; needed are {precise.POINTS}"
    ):
        precise.from_sp3(product(instants))


def thinned(made, step_s, names=None, until_s=None, after_s=None):
    """A product with some satellites' instants every step_s alone, up to one or from one."""
    t_s = (made.t_ns - START_NS) / 1e9
    rows = (t_s % step_s == 0) & (t_s <= (until_s or np.inf)) & (t_s >= (after_s or 0))
    columns = [k for k, name in enumerate(made.name) if names is None or name in names]
    return Sp3(
        "y", made.t_ns[rows], tuple(made.name[k] for k in columns), made.pos_ecef_m[rows][:, columns],
        made.clock_s[rows][:, columns],
    )  # fmt: skip


@pytest.mark.parametrize("join_s", [43_200, 45_000])
def test_days_of_two_intervals_lose_no_satellite(join_s):
    """Every half an hour first, then every 15 minutes; also where the two do not meet on the coarser grid."""
    made = product()
    both = sp3.joined([thinned(made, 1800, until_s=join_s - 1), thinned(made, 900, after_s=join_s)])
    assert precise.steps_ns(both) == [900 * 10**9, 1800 * 10**9]
    orbits = precise.layered(both)
    t_s = np.linspace(100, 86_300, 400)
    t_s = t_s[(t_s < join_s - 1800) | (t_s > join_s)]
    pos, clock, there = orbits.sample(middles(*t_s), np.zeros(1))
    assert there.all()
    for column in range(2):
        true, r_dot_v = kepler(t_s, 0.7 * column)
        inside = (t_s > 8000) & (t_s < 80_000)
        assert np.linalg.norm(pos[:, 0, column] - true, axis=1)[inside].max() < 0.5
        clock_m = C * (1e-4 + 1e-11 * t_s) - 2 * r_dot_v / C
        assert clock[:, 0, column][inside] == pytest.approx(clock_m[inside], abs=1e-3)
    assert orbits.span_ns == (START_NS, START_NS + 86_400 * gpstime.NS_PER_S)


def test_between_the_last_coarse_and_the_first_fine_instant_the_coarser_grid_goes_on():
    made = product()
    both = sp3.joined([thinned(made, 1800, until_s=41_400), thinned(made, 900, after_s=43_200)])
    t_s = np.linspace(41_400, 43_200, 31)
    pos, _, there = precise.layered(both).sample(middles(*t_s), np.zeros(1))
    assert there.all()
    assert np.linalg.norm(pos[:, 0, 0] - kepler(t_s)[0], axis=1).max() < 0.5


def test_systems_of_two_intervals_in_one_product():
    made = product()
    both = sp3.joined([thinned(made, 900, ("G05",)), thinned(made, 1800, ("R11",))])
    pos, _, there = precise.layered(both).sample(middles(40_100, 40_900, 41_700), np.zeros(1))
    assert there.all()
    for column in range(2):
        true, _ = kepler(np.array((40_100.0, 40_900.0, 41_700.0)), 0.7 * column)
        assert np.linalg.norm(pos[:, 0, column] - true, axis=1).max() < 0.5


def test_one_interval_makes_no_layers():
    assert isinstance(precise.layered(product()), precise.PreciseOrbits)
    whole, part = product(), product()
    part.pos_ecef_m[40, 0] = np.nan
    for made in (whole, part):
        found, alone = (
            make(made).sample(middles(36_500), np.zeros(1)) for make in (precise.layered, precise.from_sp3)
        )
        assert np.array_equal(found[0], alone[0])


def test_the_doubt_is_more_than_the_error_and_little_inside():
    for step_s, limit_m in ((900, 0.1), (3600, 500.0)):
        made = thinned(product(193), step_s)
        orbits = precise.layered(made)
        t_s = np.arange(60_000, 90_000, 1234.0)
        wrong_m = np.linalg.norm(
            orbits.sample(middles(*t_s), np.zeros(1))[0][:, 0, 0] - kepler(t_s)[0], axis=1
        )
        doubt_m = orbits.doubt_m(middles(*t_s))[:, 0]
        assert wrong_m.max() < doubt_m.max() < limit_m
    assert np.isnan(gap(40, 0).doubt_m(middles(STEP_S * 39.5))[0]).tolist() == [True, False]
    both = sp3.joined([thinned(product(), 1800, until_s=43_200), thinned(product(), 900, after_s=43_200)])
    assert np.isfinite(precise.layered(both).doubt_m(middles(20_000, 60_000))).all()
