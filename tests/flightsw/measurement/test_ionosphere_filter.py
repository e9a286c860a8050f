"""The filter of ionospheric delays: against a Kalman filter in matrices, and what its variances promise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.measurement.ionosphere_filter import FIRST_RATE_MPS, LONGEST_NS, follow, nothing_known
from gnss_hil.flightsw.measurement.ionosphere_free import filtered, ionosphere_free
from gnss_hil.flightsw.measurement.observables import of_each_channel
from gnss_hil.flightsw.measurement.satellite_shares import satellite_shares
from gnss_hil.flightsw.records.epoch import Measurements
from tests.support.budgets import BUDGET

pytestmark = pytest.mark.verifies(
    "flightsw/measurement/ionosphere_filter.py",
    what="Ionospheric delays followed from epoch to epoch",
    by="a Kalman filter in matrices, of delays that walk as it assumes: errors have the variances it states",
    status="validated",
)

S = 10**9
SAT, OTHER = np.array([5]), np.array([70])


def in_matrices(times_s, measured, variance, q):
    """State and covariance after each measurement; x = F x + w, Q of a white acceleration."""
    x, p, last = np.array([measured[0], 0.0]), np.diag([variance[0], FIRST_RATE_MPS**2]), times_s[0]
    out = [(x.copy(), p.copy())]
    for t, z, r in zip(times_s[1:], measured[1:], variance[1:], strict=True):
        dt, last = t - last, t
        f = np.array([[1, dt], [0, 1]])
        x, p = f @ x, f @ p @ f.T + q**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        s = p[0, 0] + r
        k = p[:, 0] / s
        x, p = x + k * (z - x[0]), (np.eye(2) - np.outer(k, [1, 0])) @ p
        out.append((x.copy(), p.copy()))
    return out


def test_it_is_the_textbooks_filter():
    rng = np.random.default_rng(1)
    times_s = np.cumsum(rng.choice([1.0, 1.0, 7.0], 60))
    measured = 12 + 0.05 * times_s + rng.normal(0, 0.5, 60)
    variance = rng.uniform(0.2, 0.6, 60)
    delays = nothing_known()
    for t, z, r, (x, p) in zip(
        times_s, measured, variance, in_matrices(times_s, measured, variance, 0.02), strict=True
    ):
        delays, followed = follow(delays, int(t * S), SAT, np.array([z]), np.array([r]), 0.02)
        assert [followed.delay_m[0], followed.rate_mps[0]] == pytest.approx(x, abs=1e-9)
        assert followed.rate_variance[0] == pytest.approx(p[1, 1])
        assert followed.variance_m2[0] == pytest.approx(p[0, 0])


def test_satellites_do_not_meet_and_antennas_of_one_are_weighed():
    both = nothing_known()
    sat, z, r = np.array([70, 5, 5]), np.array([3.0, 10.0, 16.0]), np.array([1.0, 1.0, 2.0])
    both, found = follow(both, S, sat, z, r, 0.01)
    assert found.delay_m == pytest.approx([3, 12, 12])
    assert found.share == pytest.approx([1, 2 / 3, 1 / 3])
    assert found.variance_m2 == pytest.approx([1, 2 / 3, 2 / 3])
    alone, _ = follow(nothing_known(), S, OTHER, z[:1], r[:1], 0.01)
    both, after = follow(both, 2 * S, OTHER, np.array([4.0]), np.ones(1), 0.01)
    alone, same = follow(alone, 2 * S, OTHER, np.array([4.0]), np.ones(1), 0.01)
    assert after.delay_m == same.delay_m and both.delay_m[5] == 12


@pytest.mark.parametrize(
    ("t_ns", "z", "begins"),
    [(2 * S, 10.5, False), (2 * S, 60.0, True), (S + LONGEST_NS, 10.5, False),
     (S + LONGEST_NS + 1, 10.5, True), (S, 10.5, True), (0, 10.5, True)],
)  # fmt: skip
def test_what_is_far_off_or_long_ago_or_not_later_begins_anew(t_ns, z, begins):
    delays, _ = follow(nothing_known(), S, SAT, np.array([10.0]), np.ones(1), 0.001)
    _, found = follow(delays, t_ns, SAT, np.array([z]), np.ones(1), 0.001)
    assert (found.share[0] == 1) == begins
    assert (found.delay_m[0] == z) == begins


def measurements(p1, p2, cn0=(45.0, 42.0)):
    """Of one satellite of GPS on one antenna by L1 C/A and L2C, its clocks 7 m and 9 m."""
    zero, one = np.zeros(2), np.ones(2, np.int64)
    return Measurements(
        receiver=0 * one, channel=np.array([0, 1]), sat=5 * one, pseudorange_m=np.array([p1 - 7, p2 - 9]),
        range_rate_mps=np.array([-3.0, -3.1]), cn0_dbhz=np.array(cn0), lock=5 + zero, health=zero, ura=zero,
        pos_sv_m=np.full((3, 2), 1.5e7), vel_sv_mps=np.zeros((3, 2)), clock_m=np.array([7.0, 9.0]),
        clock_drift_mps=zero, signal=np.array([0, 4]), frequency=zero,
    )  # fmt: skip


def test_the_first_epoch_is_the_combination_of_that_epoch():
    m = measurements(2.2e7 + 10, 2.2e7 + 16.5)
    _, one = filtered(m, BUDGET, nothing_known(), S, 0.01)
    plain = ionosphere_free(m, BUDGET)
    assert one.pseudorange_m + one.clock_m == pytest.approx(plain.pseudorange_m + plain.clock_m, abs=1e-6)
    assert variance_m2(one) == pytest.approx(plain.code_variance_m2)
    assert one.channels.tolist() == plain.channels.tolist() == [3]


def test_errors_have_the_variances_that_are_stated():
    """Delays that walk as assumed, noise as assumed: the errors of 400 satellites' ranges after 40 epochs."""
    rng, q, g = np.random.default_rng(5), 0.01, (77 / 60) ** 2
    noise, errors, rates, late = BUDGET, [], [], []
    for _ in range(400):
        delay, rate, delays = 15.0, rng.normal(0, FIRST_RATE_MPS), nothing_known()
        for k in range(40):
            walk = rng.multivariate_normal([0, 0], q**2 * np.array([[1 / 3, 1 / 2], [1 / 2, 1]]))
            delay, rate = delay + rate + walk[0], rate + walk[1]
            v = ionosphere_free(measurements(0, 0), noise)
            one, two = sigmas(noise)
            p1, p2 = delay + rng.normal(0, one), g * delay + rng.normal(0, two)
            delays, found = filtered(measurements(p1, p2), noise, delays, (k + 1) * S, q)
        errors.append((found.pseudorange_m[0] + found.clock_m[0]) / np.sqrt(variance_m2(found)[0]))
        late.append(variance_m2(found)[0])
        rates.append((delays.rate_mps[5] - rate) / np.sqrt(delays.variances[2, 5]))
    assert np.std(errors) == pytest.approx(1, abs=0.12) and abs(np.mean(errors)) < 0.2
    assert np.std(rates) == pytest.approx(1, abs=0.12)
    assert late[0] < 0.45 * v.code_variance_m2[0], "less noise than one epoch's combination"


def on_antennas(m, count):
    """The same satellite by both signals on several antennas; the last has the second 6 dB weaker."""
    rows = np.tile([0, 1], count)
    m = replace(m[rows], receiver=np.repeat(np.arange(count), 2))
    m.cn0_dbhz[-1] -= 6
    return m


@pytest.mark.parametrize("epochs", [1, 2, 30])
def test_a_followed_delay_is_in_the_ranges_of_all_antennas(epochs):
    """Errors of three antennas' ranges of one satellite as sums of all codes' errors, one by one: the filter
    is linear in them. Their covariance by the budget: variances as they are, and not less in common."""
    q, codes = 0.01, 6
    base = on_antennas(measurements(2.2e7 + 10, 2.2e7 + 16.5), 3)
    sigma_m = np.sqrt(of_each_channel(base, BUDGET).code_variance_m2)

    def ranges(epoch=None, code=None):
        """After the last epoch, one code of one epoch being a millimetre longer."""
        delays = nothing_known()
        for k in range(epochs):
            longer = 1e-3 * (np.arange(codes) == code) * (k == epoch)
            m = replace(base, pseudorange_m=base.pseudorange_m + longer)
            delays, z = filtered(m, BUDGET, delays, (k + 1) * S, q)
        return z

    plain = ranges()
    moved = [
        1e3 * sigma_m[code] * (ranges(k, code).pseudorange_m - plain.pseudorange_m)
        for k in range(epochs)
        for code in range(codes)
    ]
    by_noise = np.array(moved).T @ np.array(moved)
    own_m2, common_m = satellite_shares(plain.sat).split(plain.code_variance_m2, plain.followed_sigma_m)
    stated = np.diag(own_m2) + common_m @ common_m.T
    # What is stated has besides how the delay itself walks, in all alike.
    walked = stated - by_noise
    assert (own_m2 > 0).all() and common_m.shape == (3, 1)
    assert np.ptp(walked.diagonal()) < 1e-3 * stated[0, 0]
    apart = walked[np.triu_indices(3, 1)]
    assert (apart > walked[0, 0] - 1e-3).all() and (apart < walked[0, 0] + 0.06 * stated[0, 1]).all()
    if epochs == 1:
        assert walked.diagonal() == pytest.approx(0, abs=1e-5)
    assert stated.mean() > 1.5 * stated.diagonal().mean() / 3, "the mean of three is not three times as good"


def test_of_a_satellite_that_one_antenna_has_the_delays_rate_is_its_own():
    m = on_antennas(measurements(2.2e7 + 10, 2.2e7 + 16.5), 2)
    _, both = filtered(m, BUDGET, nothing_known(), S, 0.01)
    assert (both.sat_rate_sigma_mps > FIRST_RATE_MPS).all()
    variance, sigma = both.rate_variance_m2ps2, both.sat_rate_sigma_mps
    own, common = satellite_shares(both.sat).split(variance, sigma)
    assert own == pytest.approx(variance) and common[:, 0] == pytest.approx(sigma)
    own, common = satellite_shares(both.sat[:1]).split(variance[:1], sigma[:1])
    assert own[0] > FIRST_RATE_MPS**2 and common.shape == (1, 0)


def variance_m2(z):
    """(n,) of each range alone."""
    return z.code_variance_m2 + z.followed_sigma_m**2


def sigmas(budget):
    """1 sigma of both codes, as the flight software has them."""
    return np.sqrt(budget.noise.code_variance_m2(10 ** np.array([4.5, 4.2]), np.array([0, 4])))


def test_rates_are_those_of_the_first_carrier_with_the_delays_rate_taken_out():
    delays = nothing_known()
    for k in range(50):
        m = measurements(10 + 0.05 * k, (10 + 0.05 * k) * (77 / 60) ** 2)
        delays, found = filtered(m, BUDGET, delays, (k + 1) * S, 0.01)
    assert found.range_rate_mps[0] == pytest.approx(-3.0 + 0.05, abs=1e-3)
    carrier = of_each_channel(m, BUDGET)[:1]
    assert found.rate_variance_m2ps2 == pytest.approx(carrier.rate_variance_m2ps2)
    of_clock = carrier.sat_rate_sigma_mps**2
    assert found.sat_rate_sigma_mps**2 == pytest.approx(of_clock + delays.variances[2, 5])
