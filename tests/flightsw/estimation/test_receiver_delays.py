"""Delays of receivers against one another: found while nobody states them, and as far as is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gnss_hil.flightsw.attitude.attitude import attitude_now
from gnss_hil.flightsw.estimation import receiver_delays
from gnss_hil.flightsw.estimation.all_in_view import all_in_view
from gnss_hil.flightsw.estimation.base import FixInputs
from gnss_hil.flightsw.estimation.least_squares import least_squares
from gnss_hil.flightsw.estimation.snapshot import SnapshotNavigator
from gnss_hil.flightsw.integrity.exclusion import STRICT, Rules
from gnss_hil.flightsw.measurement.weights import weight
from gnss_hil.flightsw.records.epoch import AttitudeReport
from gnss_hil.flightsw.records.solution import NoFix, ReceiverDelays
from tests.support import synthetic_epochs as s
from tests.support.budgets import budget
from tests.support.fixes import SKY, craft, fix_of, in_view, measurements

pytestmark = pytest.mark.verifies(
    "flightsw/estimation/receiver_delays.py",
    what="Delays of receivers, learnt from epoch to epoch",
    by="drawn delays of 3 m found again; the scatter of what is left against the covariance",
    status="validated",
)

STEP_NS = 1_000_000_000


def flown(
    delays_m, epochs=240, seed=2, delay_m=3.0, lasting=1, later=None, rules=STRICT, restart=None, silent=None
):
    """States and solutions of a craft whose receivers are late by delays_m, with new noise every so often.

    later   epoch -> that they are late by besides; epochs may have no fix then
    restart   epoch, receiver: one that says it has restarted
    silent    epoch, receiver: one that measures nothing from then on

    Satellites stand still: what differs from epoch to epoch is the noise."""
    c = craft(rate=(0.0,))
    m = measurements(s.observe(c, in_view(c, 24), SKY, rates=False))
    m = replace(m, space_sigma_m=0 * m.space_sigma_m)
    dcm = c.dcm_body_from_eci @ s.ecef_from_eci(0.0).T
    report = AttitudeReport(s.quaternion(dcm), c.rate_body)
    attitude = attitude_now(report, None, s.T0_NS, 0)
    inputs = FixInputs(attitude, c.lever_body, c.domain, budget(delay_m=delay_m), rules=rules)
    rng = np.random.default_rng(seed)
    sigma, navigator = np.sqrt(m.code_variance_m2), SnapshotNavigator(all_in_view)
    state, out = navigator.initial(), []
    late = m.pseudorange_m + np.asarray(delays_m)[m.receiver]
    for k in range(epochs):
        if k % lasting == 0:
            noise = sigma * rng.normal(size=len(m))
        changed_m = 0.0 if later is None else np.asarray(later(k))[m.receiver]
        z = replace(m, pseudorange_m=late + changed_m + noise)
        said = None if restart is None else (np.arange(4) == restart[1]) & (k == restart[0])
        told = replace(inputs, restarted=said)
        if silent is not None and k >= silent[0]:
            z = z[np.flatnonzero(z.receiver != silent[1])]
        state, solution = navigator.update(navigator.predict(state, s.T0_NS + k * STEP_NS), z, told)
        assert solution.reason is NoFix.FIX or later is not None
        out.append((state.delays or receiver_delays.unknown(4, delay_m), solution.fix))
    return c, out


def apart(values):
    """Of receivers against their mean: what they have in common is in the clock."""
    return np.asarray(values) - np.mean(values)


def test_delays_are_found():
    delays_m = (4.0, -2.5, 0.5, 1.0)
    _, out = flown(delays_m)
    first, last = out[0][0], out[-1][0]
    assert np.abs(apart(first.mean_m) - apart(delays_m)).max() > 0.1, "one epoch hardly counts"
    assert apart(last.mean_m) == pytest.approx(apart(delays_m), abs=0.4)


def test_what_is_left_is_as_large_as_it_says():
    """Of 24 crafts whose ranges err alike for a minute: squares of the errors, by the covariance."""
    rng = np.random.default_rng(11)
    differences = np.array([[1, -1, 0, 0], [0, 1, -1, 0], [0, 0, 1, -1.0]])
    scores = []
    for seed in range(24):
        delays_m = 3.0 * rng.normal(size=4)
        _, out = flown(delays_m, epochs=240, seed=seed, lasting=60)
        found = out[-1][0]
        covariance = differences @ found.root_m @ found.root_m.T @ differences.T
        off = differences @ (found.mean_m - delays_m)
        scores.append(off @ np.linalg.solve(covariance, off))
    # 72 unit squares: their mean is 1 with a spread of 0.17; a minute counts by how much of it is over.
    assert 0.5 < np.mean(scores) / 3 < 1.6


def test_fixes_become_as_good_as_without_delays():
    c, out = flown((4.0, -2.5, 0.5, 1.0), epochs=600)
    _, plain = flown((0.0, 0.0, 0.0, 0.0), epochs=2, delay_m=0.0)
    sigma = [np.sqrt(np.trace(fix.covariance_m2)) for _, fix in (out[0], out[-1], plain[-1])]
    assert sigma[0] > 1.05 * sigma[2]
    assert sigma[1] - sigma[2] < 0.2 * (sigma[0] - sigma[2])
    truth = s.truth_ecef(c)[0]
    off = [np.linalg.norm(fix.position_m - truth) for _, fix in out[-200:]]
    assert np.sqrt(np.mean(np.square(off))) < 1.3 * sigma[1]


@pytest.mark.parametrize("delay_m", [3.0, 1000.0])
def test_delays_far_larger_than_ranges_err_by_break_nothing(delay_m):
    """Ranges of a millimetre: what is left of a delay is less than rounding makes of its square."""
    receiver = np.repeat(np.arange(4), 6)
    rng = np.random.default_rng(5)
    design = np.column_stack((rng.normal(size=(24, 3)), np.ones(24)))
    delays, drawn_m = receiver_delays.unknown(4, delay_m), delay_m * rng.normal(size=4)
    for _ in range(60):
        columns = delays.root_m[receiver]
        w = weight(np.full(24, 1e-6), columns)
        fit = least_squares(design, drawn_m[receiver] - delays.mean_m[receiver], w)
        residual = drawn_m[receiver] - delays.mean_m[receiver] - design @ fit.x
        delays = receiver_delays.learnt(delays, receiver, design, residual, w, fit.covariance, 60.0)
        variance = np.diag(delays.root_m @ delays.root_m.T)
        assert (variance > 0).all() and (variance <= delay_m**2 * (1 + 1e-9)).all()
    assert apart(delays.mean_m) == pytest.approx(apart(drawn_m), abs=1e-4 * delay_m)


@pytest.mark.parametrize("rules", [STRICT, Rules(exclude=0, refuse=False)])
def test_a_receiver_that_is_late_by_something_else_is_learnt_anew(rules):
    """Restarted, a receiver is 10 m later, which is not what was learnt of it: one minute, not for ever."""
    before = np.array((4.0, -2.5, 0.5, 1.0))
    _, out = flown(before, 420, rules=rules, later=lambda k: np.array((0, 10.0, 0, 0)) * (k >= 120))
    agree = [fix is not None and fix.misfit == 1.0 and fix.used.all() for _, fix in out]
    assert all(agree[:120]) and not any(agree[120:170]) and all(agree[185:])
    assert apart(out[-1][0].mean_m) == pytest.approx(apart(before + np.array((0, 10.0, 0, 0))), abs=1.0)


@pytest.mark.parametrize("rules", [STRICT, Rules(exclude=0, refuse=False)])
def test_a_receiver_that_says_it_has_restarted_is_learnt_anew_at_once(rules):
    """No epoch contradicts the others, and what is known of the other receivers stays known."""
    before, change = np.array((4.0, -2.5, 0.5, 1.0)), np.array((0, 6.0, 0, 0))
    _, out = flown(before, 420, rules=rules, later=lambda k: change * (k >= 120), restart=(120, 1))
    assert all(fix is not None and fix.misfit == 1.0 for _, fix in out)
    known, anew = (delays.root_m @ delays.root_m.T for delays, _ in (out[119], out[120]))
    against_others, of_others = np.array([-1, 3, -1, -1.0]) / 3, np.array([1, 0, -1, 0.0])
    assert against_others @ anew @ against_others > 2 * against_others @ known @ against_others
    assert of_others @ anew @ of_others == pytest.approx(of_others @ known @ of_others, rel=0.2)
    assert apart(out[-1][0].mean_m) == pytest.approx(apart(before + change), abs=1.0)


def test_what_was_learnt_of_a_receiver_outlasts_minutes_in_which_it_measures_nothing():
    """Its antenna is in the shadow of the craft: a delay walks a decimetre an hour."""
    _, out = flown((4.0, -2.5, 0.5, 1.0), 240, silent=(120, 1))
    assert not any(fix.used.shape == out[0][1].used.shape for _, fix in out[120:])
    against_others = np.array([-1, 3, -1, -1.0]) / 3
    known, later = (
        against_others @ (d.root_m @ d.root_m.T) @ against_others for d, _ in (out[119], out[239])
    )
    assert later < known + 0.1**2 * 4 / 3


def test_what_is_forgotten_is_as_before_anything_was_learnt():
    root = np.array([[0.2, 0.0, 0, 0], [0.1, 0.3, 0, 0], [0, 0.2, 1, 0], [0.3, 0, 0.1, 1]])
    known = ReceiverDelays(np.array([1.0, 2.0, 3.0, 4.0]), root)
    found = receiver_delays.forgotten(known, np.array([False, True, False, True]), 3.0)
    expected = root @ root.T
    expected[[1, 3]] = expected[:, [1, 3]] = 0
    expected[1, 1] = expected[3, 3] = 9
    assert found.mean_m.tolist() == [1, 0, 3, 0]
    assert found.root_m @ found.root_m.T == pytest.approx(expected)


def test_a_contradiction_of_half_a_minute_costs_nothing_that_was_learnt():
    def later(k):
        return np.array((0, 10.0, 0, 0)) * (120 <= k < 150)

    _, out = flown((4.0, -2.5, 0.5, 1.0), 160, later=later)
    first, last = (np.trace(out[k][0].root_m @ out[k][0].root_m.T) for k in (60, 159))
    assert last < first


def test_ranges_that_disagree_teach_nothing():
    c, unknown = craft(), receiver_delays.unknown(4, 3.0)
    m = measurements(s.observe(c, in_view(c, 24), SKY))
    lenient = {"rules": Rules(0, 0, refuse=False), "delays": unknown, "unlearnt_s": 60.0}
    wrong = replace(m, pseudorange_m=m.pseudorange_m + 300.0 * (np.arange(24) == 3))
    assert fix_of(c, m, **lenient).delays is not None
    assert fix_of(c, wrong, **lenient).delays is None


def test_delays_are_kept_where_an_epoch_has_no_fix():
    navigator = SnapshotNavigator(all_in_view)
    _, out = flown((4.0, -2.5, 0.5, 1.0), epochs=5)
    state = replace(navigator.initial(), delays=out[-1][0], t_ns=s.T0_NS)
    assert navigator.predict(state, s.T0_NS + STEP_NS).delays is out[-1][0]


def test_an_epoch_after_a_long_time_counts_once():
    """After an hour without a fix no more is learnt than a single epoch tells."""
    rng = np.random.default_rng(6)
    receiver = np.arange(12) % 4
    design = np.column_stack((rng.normal(size=(12, 3)), np.ones(12)))
    before = receiver_delays.unknown(4, 3.0)
    weight = np.linalg.inv(np.eye(12) + before.root_m[receiver] @ before.root_m[receiver].T)
    covariance = np.linalg.inv(design.T @ weight @ design)
    told = [
        receiver_delays.learnt(before, receiver, design, rng.normal(size=12) * 0, weight, covariance, dt_s)
        for dt_s in (receiver_delays.LASTING_S, 3600.0)
    ]
    assert told[1].root_m @ told[1].root_m.T == pytest.approx(told[0].root_m @ told[0].root_m.T)
