"""What becomes of measurements that disagree, by the rules a flight is given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.dbc.common import vehicle
from gnss_hil.flightsw.app.config import configure
from gnss_hil.flightsw.integrity.assess import assess
from gnss_hil.flightsw.integrity.consistency import Trial, agree
from gnss_hil.flightsw.integrity.exclusion import Kept, Rules
from gnss_hil.flightsw.records.solution import Fix, NoFix, Solution
from gnss_hil.flightsw.records.solution import Tested as Word
from tests.support import synthetic_epochs as s
from tests.support.fixes import SKY, craft, errors, fix_of, in_view, measurements
from tests.support.flights import fly, soyuz, status
from tests.support.flown import FakeBus, channel_frames, decoded

pytestmark = pytest.mark.verifies(
    "flightsw/integrity/exclusion.py",
    "flightsw/integrity/assess.py",
    "flightsw/integrity/options.py",
    what="Exclusion of faulty satellites, ranges and rates",
    by=(
        "chi-square test, satellites one by one, only where told apart and the rest can be tested; a lenient "
        "fix and its misfit by NumPy lstsq"
    ),
    status="modelled",
)

SOYUZ = vehicle.load(vehicle.find("soyuz-ms"))
GPS = [sat for sat in SKY if sat < 64]
LENIENT = Rules(exclude=0, receivers=0, refuse=False)


def offered(c, count, biases_m, sats=None):
    m = measurements(s.observe(c, in_view(c, count, sats=sats), SKY))
    p = m.pseudorange_m.copy()
    for row, bias_m in biases_m.items():
        p[row] += bias_m
    return replace(m, pseudorange_m=p)


def test_as_many_satellites_are_excluded_as_the_rules_say():
    c = craft()
    m = offered(c, 24, {2: -3000.0, 5: 1000.0, 9: 400.0})
    for exclude in range(3):
        assert fix_of(c, m, rules=Rules(exclude)) == NoFix.INCONSISTENT_RANGES
    fix = fix_of(c, m, rules=Rules(3))
    assert np.flatnonzero(~fix.used).tolist() == [2, 5, 9]
    assert errors(c, fix)[0] < 1e-4 and fix.misfit == 1.0
    assert fix_of(c, m, rules=Rules(9)).used.tolist() == fix.used.tolist()


def test_ranges_that_agree_are_the_same_fix_by_all_rules():
    c = craft()
    m = offered(c, 12, {})
    strict, lenient = fix_of(c, m), fix_of(c, m, rules=LENIENT)
    assert strict.position_m.tolist() == lenient.position_m.tolist()
    assert strict.covariance_m2.tolist() == lenient.covariance_m2.tolist()


@pytest.mark.parametrize("count", [5, 8])
def test_a_fix_of_ranges_that_disagree_is_least_squares_and_its_sigma_says_so(count):
    """Against NumPy's lstsq: the estimate moved by the bias, and the variance of unit weight."""
    c = craft()
    right = offered(c, count, {}, sats=GPS)
    wrong = offered(c, count, {1: 60.0, 3: -50.0}, sats=GPS)
    assert fix_of(c, wrong) == NoFix.INCONSISTENT_RANGES
    good = fix_of(c, right)
    fix = assess(Solution(NoFix.FIX, fix_of(c, wrong, rules=LENIENT))).fix
    assert isinstance(fix, Fix) and fix.used.all()

    # At 45 dBHz, early minus late power half a chip of 293 m apart, 0.5 Hz, 20 ms; satellites' own 0.6 m.
    noise = 293.05**2 * 0.5 * 0.5 / (2 * 10**4.5) * (1 + 2 / (1.5 * 0.02 * 10**4.5))
    sigma = np.sqrt(noise + 0.6**2)
    antennas = s.ecef_from_eci(0.0) @ np.array([c.antenna(a, 0.0) for a in right.receiver]).T
    away = right.pos_sv_m - antennas
    design = np.column_stack((-(away / np.linalg.norm(away, axis=0)).T, np.ones(count)))
    bias_m = wrong.pseudorange_m - right.pseudorange_m
    moved, chi2, *_ = np.linalg.lstsq(design, bias_m, rcond=None)
    # Lines of sight of the instant of transmission: the Earth's turn is 2e-5 of the bias.
    assert fix.position_m - good.position_m == pytest.approx(moved[:3], abs=2e-3 * np.linalg.norm(moved[:3]))
    assert fix.misfit == pytest.approx(chi2[0] / sigma**2 / (count - 4), rel=1e-3)
    assert fix.covariance_m2 == pytest.approx(good.covariance_m2 * fix.misfit, rel=1e-3)
    assert fix.clock_variance_m2 == pytest.approx(good.clock_variance_m2 * fix.misfit, rel=1e-3)


def test_a_fix_of_ranges_that_disagree_is_not_tested():
    """Whatever the geometry would show: nobody is to trust its orbit for five minutes."""
    c = craft()
    assert fix_of(c, offered(c, 24, {}), rules=LENIENT).tested is Word.TESTED
    assert fix_of(c, offered(c, 24, {2: 60.0}), rules=LENIENT).tested is Word.UNTESTED


def test_what_cannot_be_told_apart_is_a_fix_of_all():
    """Five satellites on four antennas: whichever is left out, the other four agree."""
    c = craft()
    five = [sat for _, sat in in_view(c, 5, sats=GPS)]
    m = measurements(s.observe(c, [(a, sat) for a in range(4) for sat in five], SKY))
    m = replace(m, pseudorange_m=m.pseudorange_m + 300.0 * (m.sat == five[2]))
    fix = fix_of(c, m, rules=Rules(exclude=4, refuse=False))
    assert fix.satellites == 5 and fix.misfit > 10


def test_no_satellite_is_excluded_if_nothing_is_left_to_test_the_others_by():
    """Five satellites, one of them on two antennas: without it four are left, and any four agree. It stands
    out by one of its two ranges, but another satellite is wrong as well."""
    c = craft()
    sats = [sat for _, sat in in_view(c, 5, sats=GPS)]
    m = measurements(s.observe(c, [*((0, sat) for sat in sats), (1, sats[0])], SKY))
    bias_m = np.array([0.0, 0.0, 300.0, 0.0, 0.0, 400.0])
    m = replace(m, pseudorange_m=m.pseudorange_m + bias_m)
    assert fix_of(c, m) == NoFix.INCONSISTENT_RANGES
    rest = m[m.sat != sats[0]]
    assert errors(c, fix_of(c, rest))[0] > 100, "which is what the others would have made"


def test_told_apart_on_the_way_to_a_lenient_fix_stays_excluded():
    c = craft()
    m = offered(c, 16, {2: -30_000.0, 5: 100.0, 9: 90.0, 11: -110.0})
    fix = fix_of(c, m, rules=Rules(exclude=1, refuse=False))
    assert np.flatnonzero(~fix.used).tolist() == [2] and fix.misfit > 10


def test_range_rates_follow_the_same_rules():
    c = craft()
    m = measurements(s.observe(c, in_view(c, 14), SKY))
    m.range_rate_mps[2] += 40.0
    m.range_rate_mps[6] -= 70.0
    assert fix_of(c, m, rules=Rules(exclude=1, receivers=0)).velocity_mps is None
    assert errors(c, fix_of(c, m, rules=Rules(exclude=2)))[1] < 1e-3
    assert 1 < errors(c, fix_of(c, m, rules=LENIENT))[1] < 200


class Noisy(FakeBus):
    """Code noise of a deviation [m], the same run after run."""

    sigma_m = 0.0

    def deliver(self, receiver, channel, o, k):
        rng = np.random.default_rng((receiver, channel, round(o["p"][k])))
        return channel_frames(receiver, channel, {**o, "p": o["p"] + self.sigma_m * rng.normal()}, k)


def test_noise_is_an_option():
    """Codes of 5 m where half a metre is expected contradict each other; with an option that states
    it they make a fix."""
    bus = Noisy(soyuz(), SKY, channels=6)
    bus.sigma_m = 5.0
    usual, stated = {"ura_scale": 0.0}, {"range_sigma_m": 5.0}
    reasons, sigmas = [], []
    for options in (usual, stated, {**usual, "inconsistent": "fix", "exclude_satellites": 0}):
        _, answers, _ = fly(bus, configure(SOYUZ, "prototype", options), 3)
        reasons.append([status(answer, "no_fix") for answer in answers])
        sigmas.append([decoded(answer, "NAV_SIGMA")["sigma_x_m"] for answer in answers])
    assert reasons == [[NoFix.INCONSISTENT_RANGES] * 3, [NoFix.FIX] * 3, [NoFix.FIX] * 3]
    # A lenient fix finds the scale by itself: 24 ranges less 5 unknowns tell it to a sixth.
    assert np.ravel(sigmas[2]) == pytest.approx(np.ravel(sigmas[1]), rel=0.5)


def test_an_option_out_of_bounds_is_refused():
    for option in ({"range_sigma_m": -1.0}, {"inconsistent": "guess"}, {"exclude_satellites": -1}):
        with pytest.raises(ValueError, match=next(iter(option))):
            configure(SOYUZ, "prototype", option)


def test_a_fit_of_rows_that_disagree_is_never_better_than_one_of_rows_that_agree():
    """One range 5.5 sigma off among a hundred that agree to a tenth of theirs: chi-square below its mean."""
    residual = 0.1 * np.ones(100)
    residual[3] = 5.5
    trial = Trial(None, np.zeros((100, 5)), residual, np.ones(100), np.zeros((5, 5)))
    assert trial.chi_square < trial.freedom and not agree(trial)
    assert Kept(trial, np.arange(100), consistent=False).misfit == 1.0
