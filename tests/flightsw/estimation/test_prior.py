"""What the fixes before say of an epoch, and what becomes of one that contradicts them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.estimation.prior import (
    ACCELERATION_MPS2,
    LEAST_TRUSTED_S,
    MOST_TRUSTED_S,
    Prior,
    contradicted,
    prior_of,
    trusted_s,
)
from gnss_hil.flightsw.integrity.exclusion import Rules
from gnss_hil.flightsw.records.solution import NoFix, OrbitState, without_motion
from gnss_hil.flightsw.records.solution import Tested as Word
from tests.support import synthetic_epochs as s
from tests.support.fixes import SKY, craft, errors, fix_of, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/prior.py",
    what="The orbit before as a judge of an epoch",
    by="drawn errors carried on by hand; faults that no other range of the epoch contradicts",
    status="validated",
)

GPS = [sat for sat in SKY if sat < 64]
RNG = np.random.default_rng(5)
POSITION, VELOCITY = s.truth_ecef(craft())


def spread(sigma):
    """A covariance (3, 3) with correlations, of deviations about sigma."""
    root = sigma * (np.eye(3) + 0.4 * RNG.normal(size=(3, 3)))
    return root @ root.T


def orbit(dt_s=1.0, trusted=LEAST_TRUSTED_S, **more):
    """Propagated for dt_s since its fix."""
    known = {"covariance_m2": spread(1.0), "velocity_covariance_m2ps2": spread(0.05), **more}
    return OrbitState(s.T0_NS, POSITION, VELOCITY, s.T0_NS - round(dt_s * 1e9), trusted_s=trusted, **known)


def prior(off_m=(0.0, 0.0, 0.0), off_mps=(0.0, 0.0, 0.0)):
    """Of a second ago: a metre and a few centimetres a second; off by so much."""
    of_velocity = (0.5**2 + 0.05**2) * np.eye(3)
    return Prior(POSITION + off_m, np.eye(3), VELOCITY + off_mps, of_velocity, checked=True)


@pytest.mark.parametrize("dt_s", [0.0, 1.0, 10.0, 60.0])
def test_it_is_as_uncertain_as_drawn_errors_carried_on(dt_s):
    """Errors of position and velocity, and an acceleration that nobody tells of, the same all the time."""
    before = orbit(dt_s, trusted=100.0)
    n = 200_000
    at_fix = np.linalg.cholesky(before.covariance_m2) @ RNG.normal(size=(3, n))
    speed = np.linalg.cholesky(before.velocity_covariance_m2ps2) @ RNG.normal(size=(3, n))
    pushed = ACCELERATION_MPS2 * RNG.normal(size=(3, n))
    found = prior_of(before)
    for drawn, said in (
        (at_fix + speed * dt_s + pushed * dt_s**2 / 2, found.covariance_m2),
        (speed + pushed * dt_s, found.velocity_covariance_m2ps2),
    ):
        assert said == pytest.approx(np.cov(drawn), abs=0.01 * np.trace(said))
    assert np.array_equal(found.position_m, POSITION) and np.array_equal(found.velocity_mps, VELOCITY)


@pytest.mark.parametrize(
    "unknown",
    [None, replace(orbit(), velocity_mps=None), orbit(covariance_m2=None),
     orbit(velocity_covariance_m2ps2=None)],
)  # fmt: skip
def test_an_orbit_that_does_not_say_how_far_it_is_known_is_not_asked(unknown):
    assert prior_of(unknown) is None


@pytest.mark.parametrize(("dt_s", "asked"), [(0.0, True), (59.9, True), (60.1, False), (3600.0, False)])
def test_it_is_asked_for_as_long_as_it_is_trusted(dt_s, asked):
    assert (prior_of(orbit(dt_s, trusted=60.0)) is not None) == asked


def test_fixes_that_are_not_where_they_must_be_contradict_it():
    """By the distance in sigmas of both: 5.4 make what happens once in 2e5 to one that is as it should be."""
    fix = fix_of(craft(), measurements(s.observe(craft(), in_view(craft(), 12), SKY)))
    assert not contradicted(fix, prior())
    for name, known in (("position_m", fix.covariance_m2 + np.eye(3)), ("velocity_mps", None)):
        if known is None:
            known = fix.velocity_covariance_m2ps2 + prior().velocity_covariance_m2ps2
        root = np.linalg.cholesky(known)
        for direction in np.linalg.qr(RNG.normal(size=(3, 3)))[0]:
            for sigmas, told in ((5.0, False), (5.6, True)):
                moved = getattr(fix, name) + root @ direction * sigmas
                at = prior(fix.position_m - POSITION, fix.velocity_mps - VELOCITY)
                assert contradicted(replace(fix, **{name: moved}), at) == told
    far = prior((1e3, 0.0, 0.0), (0.0, 1e3, 0.0))
    assert not contradicted(replace(fix, misfit=1e6), replace(far, velocity_mps=VELOCITY))
    assert contradicted(replace(fix, position_m=fix.position_m * np.nan), prior()), "no number is nowhere"
    assert contradicted(without_motion(fix), far) and not contradicted(without_motion(fix), prior())


def test_trust_grows_with_fixes_that_agree():
    fix = fix_of(craft(), measurements(s.observe(craft(), in_view(craft(), 5, sats=GPS), SKY)))
    checked, tested = (replace(fix, tested=word) for word in (Word.CHECKED, Word.TESTED))
    assert trusted_s(checked, None) == trusted_s(checked, orbit(11.0)) == LEAST_TRUSTED_S
    assert trusted_s(checked, orbit(2.0, trusted=30.0)) == 32.0
    assert trusted_s(checked, orbit(2.0, trusted=299.0)) == MOST_TRUSTED_S
    assert trusted_s(checked, orbit(31.0, trusted=30.0)) == LEAST_TRUSTED_S, "it was not asked"
    assert trusted_s(tested, None) == MOST_TRUSTED_S


def test_what_agrees_with_it_is_the_same_fix():
    """It judges the ranges, and is no part of what they make."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, 8), SKY))
    alone, judged = fix_of(c, m), fix_of(c, m, prior=prior((0.8, -0.5, 0.3), (0.2, 0.1, -0.3)))
    for name in ("position_m", "covariance_m2", "velocity_mps", "velocity_covariance_m2ps2", "clock_m"):
        assert np.array_equal(getattr(alone, name), getattr(judged, name)), name


@pytest.mark.parametrize("count", [4, 5])
def test_a_range_that_no_other_contradicts_contradicts_it(count):
    """Of four nothing is left without it; of five, the fault can be told."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, count, sats=GPS), SKY))
    wrong = replace(m, pseudorange_m=m.pseudorange_m + 500.0 * (np.arange(count) == 2))
    alone = fix_of(c, wrong)
    assert (alone is NoFix.INCONSISTENT_RANGES) if count == 5 else errors(c, alone)[0] > 100
    judged = fix_of(c, wrong, prior=prior())
    if count == 4:
        assert judged is NoFix.INCONSISTENT_RANGES
    else:
        assert np.flatnonzero(~judged.used).tolist() == [2] and errors(c, judged)[0] < 1e-3


def test_a_range_rate_that_no_other_contradicts_contradicts_it():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 4, sats=GPS), SKY))
    wrong = replace(m, range_rate_mps=m.range_rate_mps + 40.0 * (np.arange(4) == 2))
    assert errors(c, fix_of(c, wrong))[1] > 10
    judged = fix_of(c, wrong, prior=prior())
    assert judged.velocity_mps is None and errors(c, replace(judged, velocity_mps=VELOCITY))[0] < 1e-3


@pytest.mark.parametrize("count", [8, 12, 24])
def test_ranges_of_another_time_all_of_them_are_against_it(count):
    """A second ago the craft was 7 km away: ranges of then agree with each other, and none stands out."""
    c = craft()
    m = measurements(s.observe(c, in_view(c, count), SKY, t=-1.0))
    assert fix_of(c, m).used.all()
    assert fix_of(c, m, prior=prior()) is NoFix.AGAINST_ORBIT


def test_a_fix_that_is_asked_for_all_the_same_asks_nothing_before():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 12), SKY))
    fix = fix_of(c, m, prior=prior((1e5, 0, 0)), rules=Rules(exclude=0, receivers=0, refuse=False))
    assert fix.misfit == 1.0 and fix.used.all()


def test_an_orbit_that_nothing_could_contradict_bears_no_witness():
    """Four satellites are a fix of which nobody knows whether it is right; nor is it known later."""
    c = craft()
    few = measurements(s.observe(c, in_view(c, 4, sats=GPS), SKY))
    many = measurements(s.observe(c, in_view(c, 8, sats=GPS), SKY))
    witness = prior(fix_of(c, few).position_m - POSITION, fix_of(c, few).velocity_mps - VELOCITY)
    nobody = replace(witness, checked=False)
    assert fix_of(c, few).tested is fix_of(c, few, prior=nobody).tested is Word.UNTESTED
    assert fix_of(c, few, prior=witness).tested > Word.UNTESTED
    assert fix_of(c, many, prior=nobody).tested is fix_of(c, many).tested > Word.UNTESTED
