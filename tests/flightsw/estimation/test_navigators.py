"""Policies without lever arms: the mean of receivers alone, and the single best antenna.

What they are judged by is a solver of its own:
light times in the inertial frame, numerical slopes, NumPy's lstsq.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss_hil.dbc.common import vehicle
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.best_antenna import best_antenna, selected_antenna
from gnss_hil.flightsw.estimation.clocks import ReceiverClocks, mean_clocks
from gnss_hil.flightsw.estimation.receiver_mean import mean_covariance_m2, receiver_mean
from gnss_hil.flightsw.estimation.snapshot import Snapshot
from gnss_hil.flightsw.integrity.exclusion import Rules
from gnss_hil.flightsw.measurement.ionosphere import USUAL, Ionosphere
from gnss_hil.flightsw.records.solution import NoFix, OrbitState
from tests.support import synthetic_epochs as s
from tests.support.budgets import budget, sigma_m
from tests.support.fixes import LEVERS, craft, in_view, measurements, separate
from tests.support.flights import drop, fly, soyuz, status, used
from tests.support.flown import CODEC, FakeBus, decoded, position_of

pytestmark = [
    pytest.mark.verifies(
        "flightsw/estimation/receiver_mean.py",
        "flightsw/estimation/antenna_alone.py",
        what="The analogue's fix: mean of receivers alone",
        by=(
            "mean of positions solved from light times in the inertial frame by separate code; scatter of "
            "fixes against its covariance"
        ),
        status="validated",
    ),
    pytest.mark.verifies(
        "flightsw/estimation/best_antenna.py",
        what="Single best antenna",
        by="position of that antenna by the same separate solver; when it switches is our reading",
        status="validated",
    ),
]

GLONASS_OFFSET = 8
SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
SKY = s.constellation()


def at(c, ura_scale=1.0):
    """Without lever arms: covariances are of the place of antennas."""
    return FixInputs(None, np.zeros_like(c.lever_body), c.domain, budget(ura_scale))


def after(start=None, antenna=-1):
    """What an epoch before left behind: a position, a selected antenna."""
    orbit = None if start is None else OrbitState(s.T0_NS, start, None, s.T0_NS)
    return Snapshot(orbit, antenna)


def averaged(m, inputs, start=None):
    return receiver_mean(m, inputs, after(start))[0]


def rounds(c, antennas=4, count=24):
    """Every antenna with satellites of its own: the sky dealt out in turn."""
    return in_view(c, count, antennas)


def shared(c, count=7, antennas=4):
    """The same satellites on every antenna."""
    sats = [sat for _, sat in in_view(c, count)]
    return [(a, sat) for a in range(antennas) for sat in sats]


def solved_inertially(c, pairs, m):
    """Antenna's place, ECEF, from its measurements: light times in the inertial frame, nothing of the flight
    software's. The clock and the GLONASS offset are solved for with it; weights as the flight software's."""
    sats = [sat for _, sat in pairs]
    weight = 1 / sigma_m(m)
    truth = c.orbit.at(0.0)

    def misfit(x):
        place = truth + x[:3]
        out = []
        for sat, p in zip(sats, m.pseudorange_m, strict=True):
            tau = 0.07
            for _ in range(8):
                there = s.Circle.at(SKY[sat], -tau)
                tau = (np.linalg.norm(there - place) + s.shapiro(place, there)) / s.C
            out.append(s.C * (tau - s.satellite_clock(sat, -tau)[0]) + x[3] + x[4] * (sat >= 64) - p)
        return np.array(out) * weight

    def slopes(x):
        """Central differences over 20 m: far above rounding, and ranges are as good as straight there."""
        return np.array([(misfit(x + h) - misfit(x - h)) / 20.0 for h in 10.0 * np.eye(5)]).T

    x = np.zeros(5)
    for _ in range(6):
        x = x - np.linalg.lstsq(slopes(x), misfit(x), rcond=None)[0]
    return s.ecef_from_eci(0.0) @ (truth + x[:3])


def noisy(m, seed=5):
    """With the noise of the code."""
    sigma = np.sqrt(m.code_variance_m2)
    noise = sigma * np.random.default_rng(seed).normal(size=len(m))
    return replace(m, pseudorange_m=m.pseudorange_m + noise)


def alone(c, pairs, m):
    """Each antenna's place by the separate solver."""
    rows = [[k for k, (a, _) in enumerate(pairs) if a == antenna] for antenna in range(len(c.domain))]
    return [solved_inertially(c, [pairs[k] for k in mine], m[np.array(mine)]) for mine in rows]


@pytest.mark.parametrize("choice", [rounds, shared])
def test_analogue_is_the_mean_of_places_solved_by_someone_else(choice):
    c = craft()
    pairs = choice(c)
    m = noisy(measurements(s.observe(c, pairs, SKY)))
    fix = averaged(m, at(c))
    expected = np.mean(alone(c, pairs, m), axis=0)
    assert np.linalg.norm(fix.position_m - expected) < 1e-4
    assert np.linalg.norm(fix.position_m - s.truth_ecef(c)[0]) > 0.1, "noise is in it"
    assert fix.used.all() and fix.satellites == len({sat for _, sat in pairs})


def test_analogue_is_the_mean_place_of_the_antennas_and_its_velocity():
    """Without noise: mean lever arm off the centre of mass, moving as a point fixed to the body does."""
    c = craft()
    fix = averaged(measurements(s.observe(c, rounds(c), SKY)), at(c))

    def place(t):
        return s.ecef_from_eci(t) @ np.mean([c.antenna(a, t) for a in range(4)], axis=0)

    assert np.linalg.norm(fix.position_m - place(0.0)) < 1e-4
    assert np.linalg.norm(fix.position_m - s.truth_ecef(c)[0]) > 0.5
    moving = (place(-0.2) - 8 * place(-0.1) + 8 * place(0.1) - place(0.2)) / 1.2
    assert np.linalg.norm(fix.velocity_mps - moving) < 1e-3
    assert np.linalg.norm(fix.velocity_mps - s.truth_ecef(c)[1]) > 0.01


def test_analogue_leaves_out_receivers_without_a_solution():
    c = craft()
    pairs = [(a, sat) for a, sat in shared(c) if a != 2] + [(2, sat) for _, sat in in_view(c, 3)]
    pairs.sort(key=lambda pair: pair[0])
    m = measurements(s.observe(c, pairs, SKY))
    fix = averaged(m, at(c))
    assert set(m.receiver[fix.used]) == {0, 1, 3} and np.isnan(fix.residual_m[m.receiver == 2]).all()
    place = s.ecef_from_eci(0.0) @ np.mean([c.antenna(a, 0.0) for a in (0, 1, 3)], axis=0)
    assert np.linalg.norm(fix.position_m - place) < 1e-4


def test_analogue_excludes_a_faulty_satellite_in_one_receiver_only():
    c = craft()
    m = measurements(s.observe(c, shared(c, 9), SKY))
    bad = 9 + 4
    m.pseudorange_m[bad] += 3000.0
    fix = averaged(m, at(c))
    assert np.flatnonzero(~fix.used).tolist() == [bad] and not fix.gain[:, bad].any()


@pytest.mark.parametrize("solve", [receiver_mean, best_antenna])
def test_without_any_solution_the_reason_is_that_of_the_nearest(solve):
    c = craft()
    few = measurements(s.observe(c, shared(c, 3), SKY))
    assert solve(few, at(c), after())[0] == NoFix.TOO_FEW_SATELLITES
    assert solve(few[:0], at(c), after())[0] == NoFix.TOO_FEW_SATELLITES
    near = {1 + k: s.Circle(26_560e3, 0.9, 1.0, 0.4 + 1e-8 * k) for k in range(6)}
    flat = measurements(s.observe(c, [(0, sat) for sat in near], near, rates=False))
    assert solve(flat, at(c), after())[0] == NoFix.SINGULAR_GEOMETRY


def test_of_several_reasons_the_nearest_is_published():
    """Antenna 0 has ranges that contradict each other, 1 satellites in one place, 2 and 3 too few."""
    c = craft()
    near = {40 + k: s.Circle(26_560e3, 0.9, 1.0, 0.4 + 1e-8 * k) for k in range(6)}
    sats = [sat for _, sat in in_view(c, 8)]
    pairs = [*((0, sat) for sat in sats), *((1, sat) for sat in near), (2, sats[0]), (3, sats[1])]
    m = measurements(s.observe(c, pairs, {**SKY, **near}, rates=False))
    m = replace(m, pseudorange_m=m.pseudorange_m + np.where(np.arange(len(m)) < 2, [3000.0], 0.0))
    assert averaged(m, at(c)) is NoFix.INCONSISTENT_RANGES
    assert averaged(m[m.receiver != 0], at(c)) is NoFix.SINGULAR_GEOMETRY
    assert averaged(m[m.receiver > 1], at(c)) is NoFix.TOO_FEW_SATELLITES


def test_receiver_without_a_velocity_takes_it_from_the_mean():
    c = craft()
    m = measurements(s.observe(c, shared(c, 8), SKY))
    m.range_rate_mps[[2, 6]] += [400.0, -700.0]
    fix = averaged(m, at(c))
    assert fix.used.all() and fix.velocity_mps is None and fix.drift_mps is None


def test_one_clock_for_each_domain_and_the_mean_within():
    for domain in ((0, 0, 0, 0), (0, 1, 2, 2), (0, 1, 2, 3)):
        c = separate(domain)
        fix = averaged(measurements(s.observe(c, rounds(c), SKY)), at(c))
        assert fix.items == (*sorted(set(domain)), GLONASS_OFFSET)
        assert fix.clock_m / s.C == pytest.approx([*c.clock_s, 3e-8], abs=1e-12)
        assert fix.drift_mps[:-1] / s.C == pytest.approx(c.clock_rate, abs=1e-11)


def test_receivers_of_one_system_each_still_tell_clock_and_offset_apart():
    """Antennas 0 and 1 hear GPS, 2 and 3 GLONASS, all on one oscillator."""
    c = craft()
    sats = [sat for _, sat in in_view(c, 40)]
    gps, glonass = [sat for sat in sats if sat < 64][:6], [sat for sat in sats if sat >= 64][:6]
    pairs = [(a, sat) for a in range(4) for sat in (gps if a < 2 else glonass)]
    m = measurements(s.observe(c, pairs, SKY))
    fix = averaged(m, at(c))
    assert fix.items == (0, GLONASS_OFFSET)
    assert fix.clock_m / s.C == pytest.approx([1e-3, 3e-8], abs=1e-12)
    only = averaged(m[m.receiver >= 2], at(c))
    assert only.items == (0,) and only.clock_m / s.C == pytest.approx([1e-3 + 3e-8], abs=1e-12)


@given(
    st.dictionaries(st.integers(0, 7), st.floats(-1e5, 1e5), min_size=1),
    st.floats(-300, 300),
    st.data(),
)
@settings(max_examples=80, deadline=None)
def test_clocks_that_agree_are_not_changed_by_averaging(clocks, offset, data):
    """Whatever each receiver hears, the items are the contract's and the values the true ones."""
    receivers = data.draw(
        st.lists(
            st.tuples(st.sampled_from(sorted(clocks)), st.sampled_from(["gps", "glonass", "both"])),
            min_size=1,
        )
    )
    solutions = []
    systems = {"gps": {0}, "glonass": {1}, "both": {0, 1}}
    for domain, hears in receivers:
        own = clocks[domain] + offset * (hears == "glonass")
        both = hears == "both"
        items, values = (domain, GLONASS_OFFSET)[: 1 + both], np.array([own, offset][: 1 + both])
        solutions.append(ReceiverClocks(items, values, frozenset(systems[hears])))
    items, values = mean_clocks(solutions)
    heard = {d: {h for domain, h in receivers if domain == d} for d, _ in receivers}
    expected = {d: clocks[d] + offset * (h == {"glonass"}) for d, h in sorted(heard.items())}
    if any("both" in h or h == {"gps", "glonass"} for h in heard.values()):
        expected[GLONASS_OFFSET] = offset
    assert items == tuple(expected)
    assert values == pytest.approx(list(expected.values()), abs=1e-6)


def test_covariance_of_the_mean_is_the_scatter_of_fixes_with_errors_that_satellites_share():
    c = craft()
    m = replace(measurements(s.observe(c, shared(c), SKY, rates=False), cn0=40.0))
    m = replace(m, space_sigma_m=np.full(len(m), 2.8))
    start = s.truth_ecef(c)[0]
    code = np.sqrt(m.code_variance_m2)
    exact = averaged(m, at(c), start)
    rng = np.random.default_rng(11)
    scatter = []
    for _ in range(120):
        own = dict(zip(sorted(set(m.sat.tolist())), 0.5 * 2.8 * rng.normal(size=7), strict=True))
        error = code * rng.normal(size=len(m)) + [own[sat] for sat in m.sat.tolist()]
        fix = averaged(replace(m, pseudorange_m=m.pseudorange_m + error), at(c, 0.5), start)
        scatter.append(fix.position_m - exact.position_m)
    whitened = np.linalg.solve(np.linalg.cholesky(fix.covariance_m2), np.array(scatter).T)
    # 360 unit normals: the mean square is 1 with a spread of sqrt(2 / 360) = 0.075.
    assert 0.75 < (whitened**2).mean() < 1.25


def test_covariance_and_dilution_of_independent_solutions():
    """No satellite twice: sum / k^2. The same satellites on all: the code's part goes down with k alone."""
    c = craft()
    m = measurements(s.observe(c, rounds(c), SKY, rates=False))
    mean = averaged(m, at(c))
    own = [averaged(m[m.receiver == a], at(c)) for a in range(4)]
    assert mean.covariance_m2 == pytest.approx(sum(f.covariance_m2 for f in own) / 16, rel=1e-6)
    assert mean.pdop == pytest.approx(np.sqrt(sum(f.pdop**2 for f in own)) / 4)
    m = measurements(s.observe(c, shared(c), SKY, rates=False))
    mean, one = averaged(m, at(c)), averaged(m[m.receiver == 0], at(c))
    assert mean.pdop == pytest.approx(one.pdop / 2, rel=1e-4)
    start = mean.position_m
    without = mean_covariance_m2(m, mean.gain, start, at(c, 0.0))
    assert mean.covariance_m2 - without == pytest.approx(
        one.covariance_m2 - mean_covariance_m2(m[m.receiver == 0], one.gain, start, at(c, 0.0)), rel=1e-3
    )


def test_velocity_of_independent_solutions_and_of_the_same_satellites():
    """No satellite twice: sum / k^2. The same on all: carriers' noise goes down with k alone, and what
    satellites' clocks err by does not."""
    c = craft()
    m = measurements(s.observe(c, rounds(c), SKY))
    mean = averaged(m, at(c))
    own = [averaged(m[m.receiver == a], at(c)).velocity_covariance_m2ps2 for a in range(4)]
    assert mean.velocity_covariance_m2ps2 == pytest.approx(sum(own) / 16, rel=1e-6)
    m = measurements(s.observe(c, shared(c), SKY))
    mean, one = averaged(m, at(c)), averaged(m[m.receiver == 0], at(c))
    assert mean.velocity_covariance_m2ps2 == pytest.approx(one.velocity_covariance_m2ps2 / 4, rel=1e-3)
    clocks = replace(m, sat_rate_sigma_mps=np.full(len(m), 0.05))
    both, alone = averaged(clocks, at(c)), averaged(clocks[m.receiver == 0], at(c))
    assert both.velocity_covariance_m2ps2 - mean.velocity_covariance_m2ps2 == pytest.approx(
        alone.velocity_covariance_m2ps2 - one.velocity_covariance_m2ps2, rel=0.02
    )


def test_the_ionospheres_rate_is_in_the_velocities_of_all_and_does_not_average_out():
    """The same satellites on all, carriers without noise: the mean is as uncertain as each."""
    c = craft()
    m = measurements(s.observe(c, shared(c, 9), SKY))
    quiet = replace(m, rate_variance_m2ps2=np.full(len(m), 1e-12))
    inputs = replace(at(c), ionosphere=Ionosphere(USUAL, 50_400.0), rules=Rules(0, refuse=False))
    mean, one = averaged(quiet, inputs), averaged(quiet[m.receiver == 0], inputs)
    assert np.trace(one.velocity_covariance_m2ps2) > 0.002**2
    assert mean.velocity_covariance_m2ps2 / mean.rate_misfit == pytest.approx(
        one.velocity_covariance_m2ps2 / one.rate_misfit, rel=0.02, abs=1e-9
    )


def test_range_rates_that_disagree_make_the_velocity_of_the_mean_less_certain():
    c = craft()
    m = measurements(s.observe(c, shared(c, 8), SKY))
    inputs = replace(at(c), rules=Rules(0, refuse=False))
    off = replace(m, range_rate_mps=m.range_rate_mps + 5.0 * (np.arange(len(m)) == 2))
    mean, one = averaged(off, inputs), averaged(off[m.receiver == 0], inputs)
    assert one.rate_misfit > 100
    agreed = averaged(m, inputs).velocity_covariance_m2ps2
    assert mean.velocity_covariance_m2ps2 == pytest.approx(agreed * one.rate_misfit, rel=1e-3)


def test_ranges_that_disagree_make_the_mean_less_certain():
    """It is as misfit as the worst receiver; what is published grows by that."""
    c = craft()
    m = measurements(s.observe(c, shared(c, 8), SKY))
    inputs = replace(at(c), rules=Rules(exclude=0, receivers=0, refuse=False))
    off = replace(m, pseudorange_m=m.pseudorange_m + 60.0 * (np.arange(len(m)) == 2))
    mean, one = averaged(off, inputs), averaged(off[m.receiver == 0], inputs)
    assert mean.misfit == one.misfit > 100 and averaged(m, inputs).misfit == 1.0


def counted(counts):
    """Measurements of receivers that see so many satellites."""
    c = craft()
    sats = [sat for _, sat in in_view(c, 12)]
    pairs = [(a, sat) for a, n in enumerate(counts) for sat in sats[:n]]
    return measurements(s.observe(c, pairs, SKY, rates=False))


@given(st.lists(st.integers(0, 9), min_size=4, max_size=4), st.integers(-1, 3))
@settings(max_examples=60, deadline=None)
def test_leader_is_who_sees_most_and_stays_unless_another_sees_strictly_more(counts, before):
    led = selected_antenna(counted(counts), 4, before)
    assert counts[led] == max(counts)
    if before >= 0 and counts[before] == max(counts):
        assert led == before
    else:
        assert led == counts.index(max(counts))


def test_channels_on_one_satellite_are_one_satellite():
    m = counted([5, 4, 0, 0])
    twice = m[np.array([0, 0, 0, 1, *range(5, 9)])]
    assert selected_antenna(twice, 4, 0) == 1


def test_single_is_the_place_of_its_antenna_and_jumps_by_the_lever_arm():
    c = craft()
    pairs = shared(c, 9)
    m = noisy(measurements(s.observe(c, pairs, SKY)))
    places = alone(c, pairs, m)
    first, led = best_antenna(m, at(c), after())
    assert led == 0 and np.linalg.norm(first.position_m - places[0]) < 1e-4
    fewer = np.array([k for k, (a, _) in enumerate(pairs) if a != 0 or k < 7])
    second, led = best_antenna(m[fewer], at(c), after(antenna=led))
    assert led == 1 and np.linalg.norm(second.position_m - places[1]) < 1e-4
    back, led = best_antenna(m, at(c), after(antenna=led))
    assert led == 1 and np.array_equal(back.position_m, second.position_m), "as many is not more"
    still = measurements(s.observe(c, pairs, SKY))
    places = [best_antenna(rows, at(c), after())[0].position_m for rows in (still[fewer], still)]
    jump = places[0] - places[1]
    lever = s.ecef_from_eci(0.0) @ c.dcm_body_from_eci.T @ (LEVERS[1] - LEVERS[0])
    assert np.linalg.norm(jump - lever) < 1e-4


@pytest.mark.parametrize("policy", ["analogue", "single"])
def test_through_frames_without_attitude_and_without_commands(policy):
    """End to end. What is published is where the antennas are, and attitude is not missed."""
    bus = FakeBus(soyuz(), SKY)
    states, answers, _ = fly(bus, configure(SOYUZ, policy, {}), 4, tamper=drop(["ATT_Q01"], range(4)))
    which = [0, 1, 2, 3] if policy == "analogue" else [0]
    assert bus.commands == [] and len(states) == 4
    for t, answer in enumerate(answers):
        place = s.ecef_from_eci(t) @ np.mean([bus.craft.antenna(a, float(t)) for a in which], axis=0)
        # The bus rounds to 1 mm and less; times the dilution.
        assert np.linalg.norm(position_of(answer) - place) < 0.02
        assert status(answer, "satellites") == 6
        assert {receiver for receiver, _ in used(answer)} == {a + 1 for a in which}
        assert decoded(answer, "NAV_CLOCK")["item"].tolist() == [0, GLONASS_OFFSET]


def test_single_hands_the_lead_over_on_the_bus():
    """Antenna 1 falls silent for two epochs: 2 takes over and keeps the lead, as 1 sees no more than it."""

    def without_first(epoch, block):
        mine = [CODEC.can_id_of[kind, 1] for kind in ("RANGE", "SV_CLOCK")]
        return block[~np.isin(block.can_id, mine)] if epoch in (2, 3) else block

    bus = FakeBus(soyuz(), SKY)
    states, answers, _ = fly(bus, configure(SOYUZ, "single", {}), 6, tamper=without_first)
    assert [state.nav.antenna for state in states] == [0, 0, 1, 1, 1, 1]
    assert [{r for r, _ in used(a)} for a in answers] == [{1}, {1}, {2}, {2}, {2}, {2}]
    assert all(state.solution.fix is not None for state in states)


def test_policies_see_the_same_measurements():
    """What a policy without commands is given does not depend on which one it is."""
    flown = [
        fly(FakeBus(soyuz(), SKY), configure(SOYUZ, p, {}), 3)[2] for p in ("prototype", "analogue", "single")
    ]
    assert flown[0] == flown[1] == flown[2]
