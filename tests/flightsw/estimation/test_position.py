"""Block 3: the fix against synthetic measurements made in an inertial frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.estimation.least_squares import least_squares
from gnss_hil.flightsw.integrity.exclusion import Rules
from gnss_hil.flightsw.records.solution import Fix, NoFix
from tests.support import synthetic_epochs as s
from tests.support.budgets import sigma_m
from tests.support.fixes import (
    DOMAINS,
    GEO,
    GLONASS_OFFSET,
    LEO,
    MEO,
    SKY,
    craft,
    errors,
    fix_of,
    in_view,
    measurements,
    separate,
)

pytestmark = [
    pytest.mark.verifies(
        "flightsw/estimation/position.py",
        "flightsw/estimation/velocity.py",
        "flightsw/estimation/least_squares.py",
        "flightsw/measurement/range_model.py",
        "flightsw/measurement/code_range.py",
        "flightsw/measurement/range_rate.py",
        "flightsw/orbit/earth.py",
        what="Position, velocity and clocks (block 3)",
        by=(
            "measurements made in an inertial frame by separate code; NumPy lstsq; textbook PDOP; emulator, "
            "noise off: 0.1 mm"
        ),
        status="validated",
    ),
]


@pytest.mark.parametrize("orbit", [LEO, MEO, GEO], ids=["LEO", "MEO", "GEO"])
def test_fix_from_earths_centre_without_noise(orbit):
    c = craft(orbit)
    m = measurements(s.observe(c, in_view(c, 40), SKY))
    fix = fix_of(c, m)
    assert isinstance(fix, Fix)
    position, velocity = errors(c, fix)
    # 10 nm of rounding a range, times the dilution.
    assert position < 1e-6 * fix.pdop, position
    assert velocity < 2e-5 * fix.pdop, velocity
    assert fix.items == (0, GLONASS_OFFSET)
    assert fix.clock_m == pytest.approx([s.C * 1e-3, s.C * 3e-8], abs=1e-6 * fix.pdop)
    assert fix.drift_mps[0] == pytest.approx(s.C * 2e-8, abs=2e-5 * fix.pdop)


def test_warm_start_gives_the_same_fix_in_fewer_steps():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 16), SKY))
    cold = fix_of(c, m)
    warm = fix_of(c, m, s.truth_ecef(c)[0] + [30.0, -40.0, 20.0])
    assert warm.iterations == 2 < cold.iterations
    assert np.linalg.norm(warm.position_m - cold.position_m) < 2e-5
    assert errors(c, warm)[0] < 2e-5


def test_one_clock_for_each_domain():
    c = craft(
        domain=(0, 1, 2, 5), clock_s=(1e-3, -8e-4, 2e-4, 0, 0, 5e-7), rate=(1e-8, 2e-8, -3e-8, 0, 0, 4e-8)
    )
    m = measurements(s.observe(c, in_view(c, 24), SKY))
    fix = fix_of(c, m)
    assert fix.items == (0, 1, 2, 5, GLONASS_OFFSET)
    assert errors(c, fix)[0] < 1e-5
    assert fix.clock_m / s.C == pytest.approx([1e-3, -8e-4, 2e-4, 5e-7, 3e-8], abs=1e-13)


@pytest.mark.parametrize("system", ["gps", "glonass"])
def test_one_system_needs_no_offset(system):
    c = craft()
    sats = [sat for sat in SKY if (sat >= 64) == (system == "glonass")]
    fix = fix_of(c, measurements(s.observe(c, in_view(c, 12, sats=sats), SKY)))
    assert fix.items == (0,)
    assert errors(c, fix)[0] < 1e-5
    assert fix.clock_m[0] / s.C == pytest.approx(1e-3 + 3e-8 * (system == "glonass"), abs=1e-13)


def test_systems_on_separate_clocks_need_no_offset_either():
    """No domain hears both systems: each clock contains its system's offset, and one more is unobservable."""
    c = craft(domain=(0, 1, 0, 1), clock_s=(1e-3, -5e-4), rate=(0.0, 0.0))
    pairs = [(int(sat >= 64), sat) for _, sat in in_view(c, 24)]
    fix = fix_of(c, measurements(s.observe(c, pairs, SKY)))
    assert fix.items == (0, 1)
    assert errors(c, fix)[0] < 1e-5
    assert fix.clock_m / s.C == pytest.approx([1e-3, -5e-4 + 3e-8], abs=1e-13)


def test_same_satellites_on_all_antennas_is_a_fix_by_fewer_satellites():
    c = craft()
    six = [sat for _, sat in in_view(c, 6, sats=list(SKY)[::2])]
    fix = fix_of(c, measurements(s.observe(c, [(a, sat) for a in range(4) for sat in six], SKY)))
    assert fix.satellites == 6 and fix.used.sum() == 24
    assert errors(c, fix)[0] < 1e-5


def test_too_few_satellites_however_many_measurements():
    c = craft()
    gps = [sat for sat in SKY if sat < 64]
    three = [sat for _, sat in in_view(c, 3, sats=gps)]
    glonass = in_view(c, 1, sats=[sat for sat in SKY if sat >= 64])
    for pairs in (
        [(a, sat) for a in range(4) for sat in three],
        [*glonass, *((0, sat) for sat in three)],
        [],
    ):
        m = measurements(s.observe(c, pairs, SKY, rates=False))
        assert fix_of(c, m) == NoFix.TOO_FEW_SATELLITES


def test_four_satellites_with_a_clock_each_are_unobservable():
    c = craft(domain=(0, 1, 2, 3), clock_s=(0.0,) * 4, rate=(0.0,) * 4)
    gps = [sat for sat in SKY if sat < 64]
    m = measurements(s.observe(c, in_view(c, 4, sats=gps), SKY, rates=False))
    assert fix_of(c, m) == NoFix.TOO_FEW_SATELLITES


def test_satellites_in_one_place_are_singular_geometry():
    c = craft()
    near = {1 + k: s.Circle(26_560e3, 0.9, 1.0, 0.4 + 1e-8 * k) for k in range(6)}
    m = measurements(s.observe(c, [(0, sat) for sat in near], near, rates=False))
    assert fix_of(c, m) == NoFix.SINGULAR_GEOMETRY


@pytest.mark.parametrize("bias_m", [100.0, -3e4, 2e7])
def test_one_outlier_is_excluded(bias_m):
    c = craft()
    m = measurements(s.observe(c, in_view(c, 12), SKY))
    m.pseudorange_m[5] += bias_m
    for start in (None, s.truth_ecef(c)[0] + 100.0):
        fix = fix_of(c, m, start)
        assert isinstance(fix, Fix) and not fix.used[5] and fix.used.sum() == 11
        assert errors(c, fix)[0] < 1e-4


def test_one_satellite_wrong_on_all_antennas_is_excluded_whole():
    c = craft()
    nine = [sat for _, sat in in_view(c, 9)]
    m = measurements(s.observe(c, [(a, sat) for a in range(4) for sat in nine], SKY))
    for bad in nine:
        wrong = m.sat == bad
        fix = fix_of(c, replace(m, pseudorange_m=m.pseudorange_m + 200.0 * wrong))
        assert isinstance(fix, Fix) and np.array_equal(fix.used, ~wrong)
        assert errors(c, fix)[0] < 1e-5


@pytest.mark.parametrize("domain", DOMAINS)
def test_one_satellite_too_many_tells_that_something_is_wrong_but_not_what(domain):
    """One degree of freedom: whichever is left out, the rest fits. 300 m on one must not become a fix."""
    c = separate(domain)
    gps = [sat for sat in SKY if sat < 64]
    unknowns = 3 + len(set(domain))
    pairs = in_view(c, unknowns + 1, sats=gps)
    m = measurements(s.observe(c, pairs, SKY))
    assert len(m) == unknowns + 1 and isinstance(fix_of(c, m), Fix)
    for k in range(len(m)):
        p = m.pseudorange_m.copy()
        p[k] += 3000.0
        found = fix_of(c, replace(m, pseudorange_m=p))
        assert found == NoFix.INCONSISTENT_RANGES, k


def test_five_satellites_on_four_antennas_are_no_better_than_five():
    """Sixteen degrees of freedom, but any four satellites agree among themselves."""
    c = craft()
    five = [sat for _, sat in in_view(c, 5, sats=[sat for sat in SKY if sat < 64])]
    m = measurements(s.observe(c, [(a, sat) for a in range(4) for sat in five], SKY))
    for bad in five:
        assert fix_of(c, replace(m, pseudorange_m=m.pseudorange_m + 300.0 * (m.sat == bad))) == (
            NoFix.INCONSISTENT_RANGES
        )


@pytest.mark.parametrize("count", [5, 6, 8])
def test_no_sound_satellite_is_taken_for_the_faulty_one(count):
    """With noise, random geometry and faults of all sizes: right, none, or too small to be seen."""
    rng = np.random.default_rng(7)
    excluded = 0
    for _ in range(15):
        c = craft(s.Circle(6_793e3, 0.9, *rng.uniform(0, 6, 2)))
        gps = [sat for sat in SKY if sat < 64]
        rng.shuffle(gps)
        m = measurements(s.observe(c, in_view(c, count, sats=gps), SKY, rates=False))
        sigma = sigma_m(m)
        for bias_m in (10.0, 30.0, 300.0, 3000.0):
            bad = rng.integers(len(m))
            p = m.pseudorange_m + sigma * rng.normal(size=len(m))
            p[bad] += bias_m
            found = fix_of(c, replace(m, pseudorange_m=p))
            if isinstance(found, Fix) and not found.used.all():
                assert np.flatnonzero(~found.used).tolist() == [bad]
                excluded += 1
    assert (excluded > 0) == (count > 5)


@pytest.mark.parametrize("domain", [(0, 0, 0, 0), (0, 1, 2, 3)])
def test_satellite_with_a_wrong_range_rate_is_excluded_from_the_velocity(domain):
    c = separate(domain)
    m = measurements(s.observe(c, in_view(c, 16), SKY))
    m.range_rate_mps[5] += 30.0
    fix = fix_of(c, m)
    assert fix.used.all() and max(errors(c, fix)) < 1e-3
    assert fix.drift_mps[: max(domain) + 1] / s.C == pytest.approx(c.clock_rate, abs=1e-12)


def test_contradicting_range_rates_are_a_position_without_velocity():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 7), SKY))
    m.range_rate_mps[2] += 40.0
    m.range_rate_mps[6] -= 70.0
    fix = fix_of(c, m)
    assert fix.velocity_mps is None and fix.drift_mps is None
    assert np.linalg.norm(fix.position_m - s.truth_ecef(c)[0]) < 1e-4


def test_velocity_beyond_what_the_bus_carries_is_none():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 9), SKY))
    limit = 2**27 * 1e-4  # 28 bits signed of 0.1 mm/s
    for beyond in (13_400.0, limit + 100.0):
        fix = fix_of(c, replace(m, range_rate_mps=m.range_rate_mps + beyond))
        assert (fix.velocity_mps is None) == (beyond > limit)


def test_two_outliers_are_no_fix():
    """Of seven there is too little left to check the others by."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, 7), SKY))
    m.pseudorange_m[5] += 1000.0
    m.pseudorange_m[2] -= 3000.0
    assert fix_of(c, m) == NoFix.INCONSISTENT_RANGES


def test_covariance_is_the_scatter_of_fixes():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 14), SKY, rates=False), cn0=40.0)
    sigma = sigma_m(m)
    rng = np.random.default_rng(3)
    truth = s.truth_ecef(c)[0]
    scatter = []
    for _ in range(250):
        noisy = replace(m, pseudorange_m=m.pseudorange_m + sigma * rng.normal(size=len(m)))
        fix = fix_of(c, noisy, truth)
        scatter.append(fix.position_m - truth)
    whitened = np.linalg.solve(np.linalg.cholesky(fix.covariance_m2), np.array(scatter).T)
    # 750 unit normals: the mean square is 1 with a spread of sqrt(2 / 750) = 0.05.
    assert 0.8 < (whitened**2).mean() < 1.2


def test_pdop_of_one_at_zenith_and_three_on_the_horizon():
    """By hand: horizontal 1 / 1.5 each; vertical with clock [[1, -1], [-1, 4]]: 4/3. PDOP^2 = 8/3."""
    east = np.radians([0, 120, 240])
    los = np.vstack(([0, 0, 1], np.column_stack((np.cos(east), np.sin(east), 0 * east))))
    solution = least_squares(np.column_stack((-los, np.ones(4))), np.zeros(4), np.array([1.0, 4.0, 9.0, 0.5]))
    assert np.trace(solution.cofactor[:3, :3]) == pytest.approx(8 / 3)


def test_unweighted_rows_agree_with_numpys_least_squares():
    rng = np.random.default_rng(5)
    design, y, weight = rng.normal(size=(12, 5)), rng.normal(size=12), rng.uniform(0.2, 3, 12)
    root = np.sqrt(weight)
    expected = np.linalg.lstsq(design * root[:, None], y * root, rcond=None)[0]
    assert least_squares(design, y, weight).x == pytest.approx(expected)
    full = least_squares(design, y, np.diag(weight))
    assert full.x == pytest.approx(expected)
    assert full.gain @ y == pytest.approx(expected)


def test_what_rounding_makes_of_singular_matrices_is_not_observable():
    """Of a column that the others make up, the inverse has anything: 1e16 of either sign."""
    rng = np.random.default_rng(6)
    for _ in range(200):
        design, weight = rng.normal(size=(12, 5)), rng.uniform(0.2, 3, 12)
        design[:, 4] = design[:, :4] @ rng.normal(size=4)
        assert least_squares(design, np.zeros(12), weight) is None
        design[:, 4] += 1e-3 * rng.normal(size=12)
        assert least_squares(design, np.zeros(12), weight) is not None


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_a_column_that_says_nothing_is_not_observable(value):
    design = np.random.default_rng(7).normal(size=(12, 5))
    design[:, 2] = value
    with np.errstate(invalid="ignore"):
        assert least_squares(design, np.zeros(12), np.ones(12)) is None


def test_a_geometry_that_the_contract_cannot_state_is_singular():
    """Six satellites within a degree: observable, but a PDOP of 1,600 is beyond NAV_STATUS."""
    c = craft()
    w = 1e-2
    near = {
        1 + k: s.Circle(26_560e3, 0.9 + w * np.cos(2.0 * k), 1.0 + w * np.sin(1.3 * k), 0.4 + w * k)
        for k in range(6)
    }
    m = measurements(s.observe(c, [(0, sat) for sat in near], near, rates=False))
    away = m.pos_sv_m - (s.ecef_from_eci(0.0) @ c.antenna(0, 0.0))[:, None]
    design = np.column_stack((-(away / np.linalg.norm(away, axis=0)).T, np.ones(6)))
    pdop = np.sqrt(np.trace(np.linalg.inv(design.T @ design)[:3, :3]))
    assert 1000 < pdop < 3000
    assert fix_of(c, m) == NoFix.SINGULAR_GEOMETRY


def test_two_systems_need_a_fifth_satellite():
    """Four satellites of two systems on four antennas: sixteen ranges, but four rays for five unknowns."""
    c = craft()
    sats = [sat for _, sat in in_view(c, 40)]
    four = [sat for sat in sats if sat < 64][:2] + [sat for sat in sats if sat >= 64][:2]
    m = measurements(s.observe(c, [(a, sat) for a in range(4) for sat in four], SKY, rates=False))
    assert fix_of(c, m) == NoFix.TOO_FEW_SATELLITES


def test_a_start_that_leads_nowhere_is_followed_by_the_earths_centre():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 16), SKY))
    nowhere = np.array([1e12, -3e11, 4e10])
    fix = fix_of(c, m, start=nowhere)
    assert isinstance(fix, Fix) and errors(c, fix)[0] < 1e-4


def test_velocity_is_along_the_rays_of_the_solution():
    """A start 9 m aside is one step away; along its lines of sight the velocity would be off by 3 mm/s."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, 16), SKY))
    start = s.truth_ecef(c)[0] + np.array([6.0, -5.0, 4.0])
    fix = fix_of(c, m, start=start)
    assert fix.iterations == 1
    assert errors(c, fix)[1] < 2e-5 * fix.pdop


@pytest.mark.parametrize(("late_m", "carried"), [(1.09e8, True), (1.1e8, False), (-1.1e8, False)])
def test_a_clock_beyond_what_the_bus_carries_is_no_fix(late_m, carried):
    """NAV_CLOCK ends at 109,900 km."""
    c = craft(clock_s=(0.0,))
    m = measurements(s.observe(c, in_view(c, 8), SKY))
    found = fix_of(c, replace(m, pseudorange_m=m.pseudorange_m + late_m))
    assert isinstance(found, Fix) if carried else found is NoFix.NO_CONVERGENCE


@pytest.mark.parametrize(
    ("count", "row", "wrong_m"), [(7, 0, 3e7), (7, 2, 3e7), (8, 3, -2e7), (9, 0, 2e7), (12, 10, -3e7)]
)
def test_where_all_lead_nowhere_the_satellite_without_which_they_do_not_is_left_out(count, row, wrong_m):
    """Also where they do without another as well, and then exclude it: that one has less. Not where none may
    be left out."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, count), SKY))
    wrong = replace(m, pseudorange_m=m.pseudorange_m + wrong_m * (np.arange(count) == row))
    fix = fix_of(c, wrong)
    assert np.flatnonzero(~fix.used).tolist() == [row] and errors(c, fix)[0] < 1e-4
    assert fix_of(c, wrong, rules=Rules(exclude=0)) is NoFix.NO_CONVERGENCE


@pytest.mark.parametrize("row", [5, 6])
@pytest.mark.parametrize("wrong_m", [5e7, -5e7])
def test_of_two_ways_out_none_is_taken(row, wrong_m):
    """Of two GLONASS satellites beside five of GPS one is wrong: without either the other makes an offset of
    its own, and nothing tells which of them is 50,000 km off."""
    c = craft()
    gps, glonass = ([sat for sat in SKY if (sat < 64) == is_gps] for is_gps in (True, False))
    pairs = in_view(c, 5, sats=gps) + in_view(c, 4, sats=glonass)[2:]
    m = measurements(s.observe(c, pairs, SKY))
    assert fix_of(c, m[np.arange(7) != row]).clock_m[1] == pytest.approx(s.C * 3e-8, abs=1e-3)
    m.pseudorange_m[row] += wrong_m
    assert fix_of(c, m) is NoFix.NO_CONVERGENCE
